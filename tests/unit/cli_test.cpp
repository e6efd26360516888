#include "errors.h"
#include "frame_spec.h"
#include "outputs.h"
#include "progress.h"
#include "render_command.h"
#include "stats_json.h"

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <fstream>

namespace trilume::cli {
namespace {
namespace fs = std::filesystem;

using test::messageOf;

TEST(FrameSpec, ReadsWhatUsdrecordReads) {
    using Frames = std::vector<double>;
    EXPECT_EQ(parseFrameSpec("7"), Frames{7});
    EXPECT_EQ(parseFrameSpec("1:4"), (Frames{1, 2, 3, 4}));
    EXPECT_EQ(parseFrameSpec("4:1"), (Frames{4, 3, 2, 1}));
    EXPECT_EQ(parseFrameSpec("1:10x4"), (Frames{1, 5, 9}));
    EXPECT_EQ(parseFrameSpec("10:1x-4"), (Frames{10, 6, 2}));
    EXPECT_EQ(parseFrameSpec("1,5:7,3"), (Frames{1, 5, 6, 7, 3}));
    EXPECT_EQ(parseFrameSpec("-2:0"), (Frames{-2, -1, 0}));
    EXPECT_EQ(parseFrameSpec("3:3x5"), Frames{3});
    EXPECT_EQ(parseFrameSpec("2,1:3"), (Frames{2, 1, 3})) << "a frame counts once";
    EXPECT_EQ(parseFrameSpec("0:1x0.1").size(), 11u) << "binary rounding loses no last frame";
    EXPECT_EQ(parseFrameSpec("101:102x0.5"), (Frames{101, 101.5, 102}));
}

TEST(FrameSpec, NamesWhatItCannotRead) {
    for (const char* bad : {"", "a", "1:", ":4", "1:2:3", "1:4x", "1:4x0", "1:4x-1", "4:1x1", "1,,2", "1,", "1 2",
                            "nan", "inf", "1:inf", "1:1e9", "0:1x1e-9", "1x2"})
        EXPECT_NE(messageOf([&] { parseFrameSpec(bad); }).find("bad frames: --frames"), std::string::npos) << bad;
    EXPECT_NE(messageOf([] { parseFrameSpec("1:4,b"); }).find("--frames b"), std::string::npos);
}

TEST(OutputName, PutsTheFrameNumberWhereTheRunIs) {
    EXPECT_EQ(OutputName("out.exr").at(3), "out.exr");
    EXPECT_EQ(OutputName("out.####.exr").at(3), "out.0003.exr");
    EXPECT_EQ(OutputName("a#.exr").at(12345), "a12345.exr");
    EXPECT_EQ(OutputName("C#/out.####.exr").at(1), "C#/out.0001.exr") << "folders are no part of it";
    EXPECT_EQ(OutputName("C#/out.exr").at(1), "C#/out.exr");
    EXPECT_EQ(OutputName("#2.####.exr").at(1), "#2.0001.exr") << "the last run";
    EXPECT_EQ(OutputName("out.####.exr").at(-3), "out.-003.exr");
    EXPECT_EQ(OutputName("out.###.##.exr").at(7.25), "out.007.25.exr");
    EXPECT_EQ(OutputName("out.###.##.exr").at(-7.25), "out.-07.25.exr");
    EXPECT_EQ(OutputName("out###.exr").at(7), "out007.exr");
}

TEST(OutputName, FramesNeedNamesOfTheirOwn) {
    OutputName("out.exr").checkFor({5});
    OutputName("out.#.exr").checkFor({1, 2, 300});
    EXPECT_NE(messageOf([] { OutputName("out.exr").checkFor({1, 2}); }).find("put ####"), std::string::npos);
    EXPECT_NE(messageOf([] { OutputName("out.##.exr").checkFor({1, 1.25}); }).find("####.###"), std::string::npos);
    OutputName("out.##.##.exr").checkFor({1, 1.25});
    EXPECT_NE(messageOf([] { OutputName("out.##.exr").checkFor({0.5}); }).find("####.###"), std::string::npos);
    OutputName("out.exr").checkFor({0.5});
}

TEST(Progress, TellsShareFrameAndTime) {
    EXPECT_EQ(durationText(0), "0 s");
    EXPECT_EQ(durationText(59.4), "59 s");
    EXPECT_EQ(durationText(61), "1:01");
    EXPECT_EQ(durationText(3 * 3600 + 62), "3:01:02");
    const std::string line = progressLine(0.5, 90, 1, 4, 79);
    EXPECT_NE(line.find(" 50% frame 2 of 4, 1:30 left"), std::string::npos) << line;
    EXPECT_EQ(std::count(line.begin(), line.end(), '='), 20);
    for (size_t width = 0; width < 100; ++width) EXPECT_LE(progressLine(0.99, 1e9, 998, 999, width).size(), width);
    EXPECT_EQ(progressLine(1, 0, 0, 1, 200).size(), 42u + std::string(" 100% 0 s left").size());
}

TEST(Outputs, RejectsBadAovs) {
    const auto message = [](std::vector<std::string> aovs) { return messageOf([&] { Outputs("out.exr", aovs, {}); }); };
    for (const char* bad : {"depth", "=x.exr", "depth="})
        EXPECT_NE(message({bad}).find("NAME=FILE"), std::string::npos) << bad;
    EXPECT_NE(message({"depth=./out.exr"}).find("same name"), std::string::npos);
    EXPECT_NE(message({"depth=depth.png"}).find("write .exr or .pfm"), std::string::npos);
    EXPECT_NE(message({"motion=motion.hdr"}).find("write .exr or .pfm"), std::string::npos);
    const Outputs good("out.exr", {"depth=d.exr", "normal=n.png"}, {});
    EXPECT_EQ(good.aovNames(), (std::vector<std::string>{"depth", "normal"}));
}

TEST(Outputs, CompleteMeansEveryFileIsWhole) {
    std::string name = (fs::temp_directory_path() / "trilume-cli-XXXXXX").string();
    const fs::path folder = ::mkdtemp(name.data());
    Registry registry;
    const Outputs outputs((folder / "o.#.pfm").string(), {"albedo=" + (folder / "a.#.png").string()}, {});
    const ImageData image{4, 4, 3, std::vector<float>(48, 0.5f)};
    const auto cut = [&](const char* file, uintmax_t bytes) {
        fs::resize_file(folder / file, fs::file_size(folder / file) - bytes);
    };
    registry.writeImage(folder / "o.1.pfm", image);
    EXPECT_FALSE(outputs.complete(1, registry)) << "the AOV is missing";
    registry.writeImage(folder / "a.1.png", image);
    EXPECT_TRUE(outputs.complete(1, registry));
    EXPECT_FALSE(outputs.complete(2, registry));
    cut("o.1.pfm", 1);
    EXPECT_FALSE(outputs.complete(1, registry));
    registry.writeImage(folder / "o.1.pfm", image);
    EXPECT_TRUE(outputs.complete(1, registry));
    fs::resize_file(folder / "a.1.png", 0);
    EXPECT_FALSE(outputs.complete(1, registry));

    for (const char* extension : {".exr", ".hdr", ".pfm"}) {
        const std::string path = (folder / "one").string() + extension;
        registry.writeImage(path, image);
        EXPECT_TRUE(Outputs(path, {}, {}).complete(0, registry)) << extension;
        fs::resize_file(path, fs::file_size(path) - 8);
        EXPECT_FALSE(Outputs(path, {}, {}).complete(0, registry)) << extension;
        std::ofstream(path) << "no picture";
        EXPECT_FALSE(Outputs(path, {}, {}).complete(0, registry)) << extension;
    }
    fs::remove_all(folder);
}

TEST(Outputs, DisplayImagesByKind) {
    const ImageData picture{2, 1, 4, {0, 0.25f, 4, 1, 1, 1, 1, 1}};
    const ImageData shown = displayImage(picture, "", {.exposure = 1, .toneMap = ToneMap::None});
    EXPECT_EQ(shown.channels, 3u);
    ASSERT_EQ(shown.pixels.size(), 6u);
    EXPECT_EQ(shown.pixels[0], 0);
    EXPECT_NEAR(shown.pixels[1], srgbFromLinear(0.5f), 1e-6);
    EXPECT_NEAR(shown.pixels[2], 1, 1e-6);
    EXPECT_EQ(displayImage({1, 1, 3, {-1, 0, 1}}, "normal", {.exposure = 5}).pixels, (std::vector<float>{0, 0.5f, 1}));
    const float albedo = displayImage({1, 1, 3, {0.18f, 0.18f, 0.18f}}, "albedo", {.exposure = 5}).pixels[0];
    EXPECT_NEAR(albedo, srgbFromLinear(0.18f), 1e-6) << "albedo has no exposure";
}

TEST(Stats, JsonHoldsTheContract) {
    FrameStats frame;
    frame.ms = 12.5;
    frame.spp = 4;
    frame.nodes = {{"pathtrace", "run", "", 11}, {"caustics", "skipped", "no caster", 0}};
    frame.rays = 1'000'000'000'000;
    frame.tlasBuilt = 1;
    frame.memoryBytes = 1 << 20;
    RunStats stats;
    stats.device.name = "llvmpipe";
    stats.tracer = gpu::Tracer::Query;
    stats.technique = "pathtrace";
    stats.startup = {1, 2, 3, 4, {{"passes/a.comp", 5, 6, 7}}};
    stats.frames.push_back({7, frame});
    const auto json = nlohmann::json::parse(statsJson(stats).dump());
    const auto keysOf = [](const nlohmann::json& object) {
        std::vector<std::string> keys;
        for (const auto& [key, value] : object.items()) keys.push_back(key);
        return keys;
    };
    EXPECT_EQ(keysOf(json), (std::vector<std::string>{"device", "frames", "height", "pipelines", "stage", "startup_ms",
                                                      "technique", "tracer", "version", "width"}));
    EXPECT_EQ(json["pipelines"].at(0).dump(),
              R"({"dispatch_ms":7.0,"driver_ms":6.0,"name":"passes/a.comp","spirv_ms":5.0})");
    EXPECT_EQ(keysOf(json["device"]), (std::vector<std::string>{"driver", "name", "type"}));
    EXPECT_EQ(keysOf(json["startup_ms"]), (std::vector<std::string>{"device", "first_frame", "load", "pipelines"}));
    EXPECT_EQ(json["tracer"], "query");
    const auto& f = json["frames"].at(0);
    EXPECT_EQ(keysOf(f), (std::vector<std::string>{"accel", "effort", "frame", "host_ms", "memory_bytes", "ms", "nodes",
                                                   "nonfinite", "photons", "probes", "rays", "spp", "unowned",
                                                   "uploaded_bytes", "warmup_ms"}));
    EXPECT_EQ(keysOf(f["accel"]), (std::vector<std::string>{"blas_built", "blas_refit", "tlas_built"}));
    EXPECT_EQ(keysOf(f["probes"]), (std::vector<std::string>{"active", "total", "updated"}));
    EXPECT_EQ(keysOf(f["nodes"].at(0)), (std::vector<std::string>{"ms", "name", "reason", "state"}));
    EXPECT_EQ(f["frame"], 7);
    EXPECT_EQ(f["rays"], 1'000'000'000'000);
    EXPECT_EQ(f["nodes"].at(1)["reason"], "no caster");
}

RenderArguments parse(const std::string& line) {
    CLI::App app;
    RenderArguments arguments;
    addRenderCommand(app, arguments);
    app.parse(line);
    return arguments;
}

TEST(RenderOptions, AreReadAsTheContractSays) {
    const RenderArguments a =
        parse("render --camera /c -f -2:4x2 --imageWidth 32 -t pathtrace --spp 8 --warmup 2 --seed 5 "
              "--set a.b=1 --set c.d=x --enable e --disable g --tracer query --device 1 --exposure -1.5 "
              "--tonemap aces --aov depth=d.exr --stats s.json --resume --progress off "
              "--default-light off s.usda o.exr");
    EXPECT_EQ(a.stage, "s.usda");
    EXPECT_EQ(a.output, "o.exr");
    EXPECT_EQ(a.camera, "/c");
    EXPECT_EQ(a.frames, "-2:4x2");
    EXPECT_EQ(a.width, 32u);
    EXPECT_EQ(a.height, 0u);
    EXPECT_EQ(a.spp, 8u);
    EXPECT_EQ(a.sets, (std::vector<std::string>{"a.b=1", "c.d=x"}));
    EXPECT_EQ(a.enabled, std::vector<std::string>{"e"});
    EXPECT_EQ(a.disabled, std::vector<std::string>{"g"});
    EXPECT_EQ(a.tracer, gpu::Tracer::Query);
    EXPECT_EQ(a.display.exposure, -1.5);
    EXPECT_EQ(a.display.toneMap, ToneMap::Aces);
    EXPECT_EQ(a.progress, ProgressMode::Off);
    EXPECT_EQ(a.defaultLight, "off");
    EXPECT_TRUE(a.resume);
    EXPECT_EQ(parse("render --set a.b=1 s.usda o.exr").stage, "s.usda") << "an option takes one value";
}

TEST(RenderOptions, BadOnesAreRejected) {
    for (const char* bad :
         {"render", "render s.usda", "render s.usda o.exr more", "render s.usda o.exr --spp 0",
          "render s.usda o.exr --spp x", "render s.usda o.exr --spp -1", "render s.usda o.exr --time 0",
          "render s.usda o.exr --time 1 --spp 2", "render s.usda o.exr --tracer none",
          "render s.usda o.exr --imageWidth 0", "render s.usda o.exr --imageWidth 40000", "render s.usda o.exr --wat",
          "render s.usda o.exr --exposure nan", "render s.usda o.exr --denoise maybe"})
        EXPECT_THROW(parse(bad), CLI::ParseError) << bad;
}

} // namespace
} // namespace trilume::cli
