#include "ddgi.h"
#include "plugin/plugin_cpp.h"

static void registerPlugin(trilume::Registry& registry) {
    using trilume::ParamCost;
    registry.addParam({.name = "ddgi.gather",
                       .defaultValue = std::string("probe"),
                       .choices = {"probe", "final"},
                       .doc = "Where probes are looked up: at the visible point (fast, blurs detail smaller than the "
                              "spacing of probes), or where one ray from it arrives (less bias, more noise).",
                       .cost = ParamCost::Specialization,
                       .resetsHistory = true});
    registry.addParam(
        {.name = "ddgi.probes",
         .defaultValue = int64_t{6144},
         .minimum = 125,
         .maximum = 262144,
         .unit = "probes",
         .doc = "Probes of a grid at most; its spacing follows from it and from the scene's bounds. Fewer blur more.",
         .cost = ParamCost::Structural,
         .resetsHistory = true});
    registry.addParam({.name = "ddgi.volumes",
                       .defaultValue = int64_t{1},
                       .minimum = 1,
                       .maximum = int64_t{trilume::shared::kProbeVolumes},
                       .unit = "grids",
                       .doc =
                           "Grids of probes: one fits the scene, and each of the others, which follow the camera, is "
                           "four times finer than the one before. For large scenes with small rooms.",
                       .cost = ParamCost::Structural,
                       .resetsHistory = true});
    registry.addParam({.name = "ddgi.rays",
                       .defaultValue = int64_t{64},
                       .minimum = 16,
                       .maximum = 256,
                       .unit = "rays",
                       .doc = "Rays in one update of a probe.",
                       .cost = ParamCost::Structural});
    registry.addParam({.name = "ddgi.budget",
                       .defaultValue = int64_t{32768},
                       .minimum = 1024,
                       .maximum = 16777216,
                       .unit = "rays",
                       .doc =
                           "Probe rays a frame, shared by the probes that are awake, while something changes or frames "
                           "are averaged. Fewer settle more slowly.",
                       .least = 8192});
    registry.addParam({.name = "ddgi.settledShare",
                       .defaultValue = 0.03125,
                       .minimum = 0,
                       .maximum = 1,
                       .doc = "Share of ddgi.budget that refines the probes of a scene which stands still, spent in "
                              "one of up to eight frames; 0: hardly any."});
    registry.addParam({.name = "ddgi.bounces",
                       .defaultValue = int64_t{8},
                       .minimum = 0,
                       .maximum = 1024,
                       .doc = "Bounces that the first frame brings at once, with few rays each; half-way the probes' "
                              "light is raised to what all bounces would make of it."});
    registry.addParam({.name = "ddgi.tolerance",
                       .defaultValue = 0.04,
                       .minimum = 0,
                       .maximum = 1,
                       .doc = "Standard error, relative, of its irradiance at which a probe goes to sleep; 0: never. "
                              "Sleepers go on improving, once in 128 rounds or more."});
    registry.addNode({"ddgi", "ddgi", [] { return std::make_unique<trilume::DdgiNode>(); }});
}

TL_PLUGIN("ddgi", registerPlugin)
