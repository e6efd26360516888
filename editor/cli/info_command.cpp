#include "info_command.h"

#include "core/error.h"
#include "core/text.h"
#include "core/version.h"
#include "render/renderer.h"

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace trilume::cli {
namespace {

using Json = nlohmann::ordered_json;

/// Loads every plugin, so that its parameters are known, or the reason why it was declined.
void loadAll(Registry& registry) {
    for (const Registry::PluginInfo& plugin : registry.plugins()) {
        try {
            registry.loadPlugin(plugin.directory);
        } catch (const Error&) {
            continue; // plugins() tells the reason.
        }
    }
}

Json deviceJson(const gpu::DeviceInfo& device) {
    return {{"index", device.index},    {"name", device.name},          {"driver", device.driver},
            {"type", device.type},      {"ray_query", device.rayQuery}, {"usable", device.missing.empty()},
            {"missing", device.missing}};
}

/// Software drivers have slower ray queries than the compute tracer, but they have them.
Json tracersJson(const std::vector<gpu::DeviceInfo>& devices) {
    Json query = Json::array(), compute = Json::array();
    for (const gpu::DeviceInfo& device : devices) {
        if (!device.missing.empty()) continue;
        compute.push_back(device.index);
        if (device.rayQuery) query.push_back(device.index);
    }
    return Json::array({{{"name", "compute"}, {"devices", compute}}, {{"name", "query"}, {"devices", query}}});
}

Json techniqueJson(const Technique& technique, const std::string& defaultName) {
    return {{"name", technique.name},           {"default", technique.name == defaultName},
            {"reference", technique.reference}, {"overlapping", technique.overlapping},
            {"nodes", technique.nodes},         {"doc", technique.doc}};
}

Json pluginJson(const Registry::PluginInfo& plugin) {
    return {{"name", plugin.name},
            {"version", plugin.version},
            {"description", plugin.description},
            {"directory", plugin.directory.string()},
            {"nodes", plugin.nodes},
            {"scene_readers", plugin.sceneExtensions},
            {"image_writers", plugin.imageExtensions},
            {"loaded", plugin.loaded},
            {"declined", plugin.declined}};
}

const char* typeName(const ParamRow& row) {
    constexpr const char* kNames[] = {"bool", "int", "float", "text"};
    return row.choices.empty() ? kNames[row.defaultValue.index()] : "choice";
}

const char* costName(ParamCost cost) {
    switch (cost) {
    case ParamCost::Dynamic:
        return "dynamic";
    case ParamCost::Specialization:
        return "specialization";
    case ParamCost::Structural:
        return "structural";
    }
    return "";
}

Json paramJson(const ParamRow& row) {
    Json json{{"name", row.name}, {"type", typeName(row)}};
    std::visit([&](const auto& value) { json["default"] = value; }, row.defaultValue);
    if (std::holds_alternative<int64_t>(row.defaultValue) || std::holds_alternative<double>(row.defaultValue)) {
        json["minimum"] = row.minimum;
        json["maximum"] = row.maximum;
    }
    if (!row.choices.empty()) json["choices"] = row.choices;
    json["unit"] = row.unit;
    json["cost"] = costName(row.cost);
    json["resets_history"] = row.resetsHistory;
    if (row.least != 0) json["least_effort"] = row.least;
    json["doc"] = row.doc;
    return json;
}

/// The registry of an engine, which adds the frame's own parameters; without a usable device, of plugins alone.
Json infoJson() {
    const std::vector<gpu::DeviceInfo> devices = gpu::listDevices();
    const bool usable = std::any_of(devices.begin(), devices.end(), [](const auto& d) { return d.missing.empty(); });
    std::unique_ptr<Engine> engine;
    std::unique_ptr<Registry> alone;
    if (usable)
        engine = std::make_unique<Engine>(EngineOptions{});
    else
        alone = std::make_unique<Registry>();
    Registry& registry = engine ? engine->registry() : *alone;
    loadAll(registry);

    Json info{{"version", TRILUME_VERSION},  {"devices", Json::array()}, {"tracers", tracersJson(devices)},
              {"techniques", Json::array()}, {"plugins", Json::array()}, {"parameters", Json::array()}};
    info["scene_formats"] = registry.sceneExtensions();
    info["image_formats"] = registry.imageExtensions();
    const std::string defaultName = registry.techniques().empty() ? "" : registry.defaultTechnique().name;
    for (const gpu::DeviceInfo& device : devices) info["devices"].push_back(deviceJson(device));
    for (const Technique& technique : registry.techniques())
        info["techniques"].push_back(techniqueJson(technique, defaultName));
    for (const Registry::PluginInfo& plugin : registry.plugins()) info["plugins"].push_back(pluginJson(plugin));
    for (const ParamRow& row : registry.params().rows()) info["parameters"].push_back(paramJson(row));
    return info;
}

std::string textOf(const Json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

std::string rangeText(const Json& row) {
    if (row.contains("choices")) return commaList(row["choices"].get<std::vector<std::string>>());
    if (!row.contains("minimum")) return "";
    const std::string unit = row["unit"].get<std::string>();
    return fmt::format("{:g} to {:g}{}{}", row["minimum"].get<double>(), row["maximum"].get<double>(),
                       unit.empty() ? "" : " ", unit);
}

void printText(const Json& info) {
    fmt::print("trilume {}\n\ndevices\n", textOf(info["version"]));
    for (const Json& d : info["devices"])
        fmt::print("  {} {} ({}, {}): {}\n", d["index"].dump(), textOf(d["name"]), textOf(d["driver"]),
                   textOf(d["type"]),
                   !d["usable"].get<bool>()     ? "lacks " + textOf(d["missing"])
                   : d["ray_query"].get<bool>() ? "tracers compute, query"
                                                : "tracer compute");
    if (info["devices"].empty()) fmt::print("  none: install a Vulkan 1.3 driver\n");
    fmt::print("\ntechniques\n");
    for (const Json& t : info["techniques"])
        fmt::print("  {:<16} {}{}\n", textOf(t["name"]), textOf(t["doc"]),
                   t["default"].get<bool>() ? " (default)" : "");
    fmt::print("\nplugins\n");
    for (const Json& p : info["plugins"]) {
        const std::string declined = textOf(p["declined"]);
        fmt::print("  {:<16} {:<8} {}\n", textOf(p["name"]), textOf(p["version"]),
                   declined.empty() ? textOf(p["description"]) : "declined: " + declined);
    }
    fmt::print("\nformats\n  scenes {}\n  images {}\n",
               commaList(info["scene_formats"].get<std::vector<std::string>>()),
               commaList(info["image_formats"].get<std::vector<std::string>>()));
    fmt::print("\nparameters (--set NAME=VALUE)\n");
    for (const Json& row : info["parameters"]) {
        const std::string range = rangeText(row);
        fmt::print("  {} = {}{}\n      {}\n", textOf(row["name"]), textOf(row["default"]),
                   range.empty() ? "" : "  [" + range + "]", textOf(row["doc"]));
    }
}

} // namespace

CLI::App* addInfoCommand(CLI::App& app, InfoArguments& arguments) {
    CLI::App* command = app.add_subcommand("info", "Show devices, techniques, plugins and parameters");
    command->add_flag("--json", arguments.json, "as one JSON object");
    return command;
}

void runInfo(const InfoArguments& arguments) {
    const Json info = infoJson();
    if (arguments.json)
        fmt::print("{}\n", info.dump(2));
    else
        printText(info);
}

} // namespace trilume::cli
