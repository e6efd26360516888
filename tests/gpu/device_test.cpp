// The device itself: memory, uploads, dispatches, submissions, timestamps and its errors.
#include "gpu/gpu_fixture.h"

#include "core/log.h"
#include "errors.h"

#include <cstdlib>
#include <numeric>

using namespace trilume;
using trilume::test::errorOf;
using trilume::test::GpuTest;

namespace {

struct ScalePush {
    VkDeviceAddress in, out;
    float factor;
    uint32_t count;
};
const std::string kScale = R"(
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { floatRef source; floatRef result; float factor; uint count; } push;
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i < push.count) push.result.v[i] = push.source.v[i] * push.factor;
}
)";

/// Keeps the device busy for a while, so that what follows is queued behind it.
const std::string kSlow = R"(
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { floatRef result; uint rounds; } push;
void main() {
    float x = float(gl_GlobalInvocationID.x);
    for (uint i = 0; i < push.rounds; ++i) x = sin(x) + 1.5;
    push.result.v[gl_GlobalInvocationID.x] = x;
}
)";
struct SlowPush {
    VkDeviceAddress result;
    uint32_t rounds;
};

class DeviceTest : public GpuTest {
protected:
    /// The error that `action` throws, or fails the test.
    static std::vector<uint32_t> numbers(size_t count, uint32_t first) {
        std::vector<uint32_t> data(count);
        std::iota(data.begin(), data.end(), first);
        return data;
    }
};

// ---- Memory ----------------------------------------------------------------------------------------

TEST_F(DeviceTest, buffersKeepWhatIsUploaded) {
    const auto data = numbers(100'003, 7);
    EXPECT_EQ(read<uint32_t>(bufferOf(data), data.size()), data);
}

TEST_F(DeviceTest, aBufferOfNothingHasAnAddress) {
    const auto buffer = bufferFor<uint32_t>(0);
    EXPECT_EQ(buffer.size(), 16u);
    EXPECT_NE(buffer.address(), 0u);
}

TEST_F(DeviceTest, movingABufferLeavesAnEmptyOne) {
    gpu::Buffer a = bufferFor<float>(10), b = std::move(a);
    EXPECT_FALSE(a);
    EXPECT_EQ(a.address(), 0u);
    EXPECT_EQ(a.mapped(), nullptr);
    EXPECT_TRUE(b);
}

TEST_F(DeviceTest, uploadsWhileBusyArriveInOrderAheadOfTheNextSubmission) {
    const auto slow = compile(kSlow);
    const auto scratch = bufferFor<float>(4096);
    gpu::Buffer data = bufferOf(numbers(1000, 0));
    const auto copy = bufferFor<uint32_t>(1000);
    device().submit([&](gpu::Commands& c) { c.dispatch(slow, SlowPush{scratch.address(), 20'000}, 4096); });
    // The device is busy: these are staged. The second overlaps the first, and both must leave the third's place alone.
    device().upload(data, 0, std::as_bytes(std::span<const uint32_t>(numbers(600, 10'000))));
    device().upload(data, 400 * 4, std::as_bytes(std::span<const uint32_t>(numbers(400, 20'000))));
    device().upload(data, 800 * 4, std::as_bytes(std::span<const uint32_t>(numbers(200, 30'000))));
    device().submit([&](gpu::Commands& c) { c.copy(data, 0, copy, 0, 4000); });
    const auto result = read<uint32_t>(copy, 1000);
    for (uint32_t i = 0; i < 1000; ++i)
        ASSERT_EQ(result[i], i < 400 ? 10'000 + i : i < 800 ? 20'000 + i - 400 : 30'000 + i - 800) << i;
}

TEST_F(DeviceTest, aBufferLivesUntilItsSubmissionIsDone) {
    const auto slow = compile(kSlow), scale = compile(kScale);
    const auto scratch = bufferFor<float>(4096), out = bufferFor<float>(1000);
    {
        const auto in = bufferOf(std::vector<float>(1000, 2.f));
        device().submit([&](gpu::Commands& c) {
            c.dispatch(slow, SlowPush{scratch.address(), 20'000}, 4096);
            c.dispatch(scale, ScalePush{in.address(), out.address(), 5, 1000}, 1000);
        });
    }
    // Would take the place of `in` if that were free already.
    const auto other = bufferOf(std::vector<float>(1000, -1.f));
    EXPECT_EQ(read<float>(out, 1000), std::vector<float>(1000, 10.f));
}

TEST_F(DeviceTest, memoryComesBack) {
    device().waitIdle();
    device().submit([](gpu::Commands&) {});
    device().waitIdle();
    bufferFor<float>(1); // any creation collects what earlier tests left
    const size_t before = device().memoryInUse();
    for (int i = 0; i < 200; ++i) {
        const auto buffer = bufferFor<float>(1 << 20);
        device().submit([&](gpu::Commands& c) { c.fill(buffer, 0, 4 << 20, 0); });
    }
    device().waitIdle();
    bufferFor<float>(1);
    EXPECT_LE(device().memoryInUse(), before + 4096);
}

TEST_F(DeviceTest, stagingDoesNotGrowWithTheNumberOfUploads) {
    gpu::Buffer buffer = bufferFor<float>(1 << 16);
    const std::vector<float> data(1 << 16, 1.f);
    size_t early = 0;
    for (int frame = 0; frame < 100; ++frame) {
        device().submit([&](gpu::Commands& c) { c.fill(buffer, 0, 4 << 16, 0); });
        device().upload(buffer, 0, std::as_bytes(std::span(data)));
        if (frame == 10) early = device().memoryInUse();
    }
    EXPECT_LE(device().memoryInUse(), early + (4 << 20));
    EXPECT_EQ(read<float>(buffer, data.size()), data);
}

TEST_F(DeviceTest, outOfMemoryNamesWhoAskedForHowMuch) {
    gpu::Device small({.device = "auto", .validation = true, .memoryLimit = 32 << 20});
    const auto kept = small.createBuffer(10 << 20, gpu::Memory::Device, "the first");
    const Error error = errorOf([&] { small.createBuffer(30 << 20, gpu::Memory::Device, "the photon map"); });
    EXPECT_EQ(error.fault(), Fault::Run);
    EXPECT_NE(error.problem().find("out of memory: the photon map asked for 30.0 MiB"), std::string::npos)
        << error.what();
    EXPECT_EQ(error.where(), small.info().name);
    // The failed request leaves the device usable, and freed memory can be had again.
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(small.createBuffer(18 << 20, gpu::Memory::Device, "again"));
    EXPECT_EQ(small.validationMessages(), 0u);
}

TEST_F(DeviceTest, memoryRetiredWhileUploadsAreQueuedComesBack) {
    gpu::Device small({.device = "auto", .validation = true, .memoryLimit = 64 << 20});
    const auto image = small.createImage(1, 1, VK_FORMAT_R8G8B8A8_UNORM, std::vector<std::byte>(4), {}, "queued");
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(small.createBuffer(40 << 20, gpu::Memory::Device, "again"));
    EXPECT_EQ(small.validationMessages(), 0u);
}

TEST_F(DeviceTest, aRequestBeyondTheDevicesLimitIsOutOfMemory) {
    const Error error = errorOf([&] { device().createBuffer(size_t{1} << 50, gpu::Memory::Device, "far too much"); });
    EXPECT_NE(error.problem().find("far too much asked for"), std::string::npos) << error.what();
}

TEST_F(DeviceTest, rangesAreChecked) {
    gpu::Buffer buffer = bufferFor<uint32_t>(16);
    std::vector<std::byte> bytes(65);
    EXPECT_THROW(device().upload(buffer, 0, bytes), Error);
    EXPECT_THROW(device().download(buffer, 60, std::span(bytes).first(8)), Error);
    EXPECT_THROW(device().download(buffer, SIZE_MAX, std::span(bytes).first(8)), Error);
}

// ---- Work ------------------------------------------------------------------------------------------

TEST_F(DeviceTest, dispatchCoversEveryThread) {
    std::vector<float> data(1001);
    std::iota(data.begin(), data.end(), 0.f);
    const auto in = bufferOf(data);
    const auto out = bufferFor<float>(data.size());
    runCompute(kScale, ScalePush{in.address(), out.address(), 3, 1001}, 1001);
    const auto result = read<float>(out, data.size());
    for (size_t i = 0; i < data.size(); ++i) ASSERT_EQ(result[i], 3 * data[i]) << i;
}

TEST_F(DeviceTest, localSizeAndConstantsCanBeSpecialized) {
    const std::string source = R"(#version 460
        #extension GL_GOOGLE_include_directive : require
        #include "shared/types.h"
        layout(local_size_x_id = 0, local_size_y = 2) in;
        layout(constant_id = 1) const uint value = 5;
        layout(push_constant, scalar) uniform Push { uintRef result; } push;
        void main() {
            const uint width = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
            push.result.v[gl_GlobalInvocationID.y * width + gl_GlobalInvocationID.x] =
                value * 1000 + gl_WorkGroupSize.x * gl_WorkGroupSize.y;
        }
    )";
    const auto out = bufferFor<uint32_t>(48 * 4);
    const auto pipeline = device().createPipeline({.path = "specialized", .specialization = {16, 9}, .text = source});
    device().submit([&](gpu::Commands& c) {
        c.fill(out, 0, 48 * 4 * 4, 0);
        c.barrier();
        c.dispatch(pipeline, out.address(), 33, 3); // 3 x 2 groups of 16 x 2
    });
    EXPECT_EQ(read<uint32_t>(out, 48 * 4), std::vector<uint32_t>(48 * 4, 9032u));
}

TEST_F(DeviceTest, pipelinesCompileTogether) {
    std::vector<gpu::ShaderSource> sources;
    for (uint32_t i = 0; i < 8; ++i)
        sources.push_back({.path = "variant",
                           .defines = {{"VARIANT", std::to_string(i)}},
                           .text = "#version 460\n#extension GL_GOOGLE_include_directive : require\n"
                                   "#include \"shared/scene.h\"\n layout(local_size_x = 1) in;\n"
                                   "layout(push_constant, scalar) uniform Push { uintRef result; } push;\n"
                                   "void main() { push.result.v[VARIANT] = VARIANT + 100; }"});
    const auto out = bufferFor<uint32_t>(sources.size());
    const auto pipelines = device().createPipelines(sources);
    device().submit([&](gpu::Commands& c) {
        for (const auto& pipeline : pipelines) c.dispatch(pipeline, out.address(), 1);
    });
    EXPECT_EQ(read<uint32_t>(out, sources.size()), numbers(sources.size(), 100));

    sources[5].text = "nonsense";
    EXPECT_THROW(device().createPipelines(sources), Error);
}

TEST_F(DeviceTest, barriersOrderWork) {
    const auto scale = compile(kScale);
    const auto a = bufferOf(std::vector<float>(5000, 1.f)), b = bufferFor<float>(5000);
    device().submit([&](gpu::Commands& c) {
        for (int i = 0; i < 5; ++i) {
            c.dispatch(scale, ScalePush{a.address(), b.address(), 2, 5000}, 5000);
            c.barrier();
            c.dispatch(scale, ScalePush{b.address(), a.address(), 2, 5000}, 5000);
            c.barrier();
        }
    });
    EXPECT_EQ(read<float>(a, 5000), std::vector<float>(5000, 1024.f));
}

TEST_F(DeviceTest, submissionsSeeEarlierOnes) {
    const auto scale = compile(kScale);
    const auto a = bufferOf(std::vector<float>(5000, 1.f));
    for (int i = 0; i < 10; ++i)
        device().submit([&](gpu::Commands& c) {
            c.dispatch(scale, ScalePush{a.address(), a.address(), 2, 5000}, 5000);
        });
    EXPECT_EQ(read<float>(a, 5000), std::vector<float>(5000, 1024.f));
}

TEST_F(DeviceTest, fillAndCopyKeepToTheirRange) {
    const auto a = bufferOf(numbers(16, 0)), b = bufferOf(numbers(16, 100));
    device().submit([&](gpu::Commands& c) {
        c.fill(a, 16, 8, 77);
        c.barrier();
        c.copy(a, 12, b, 4, 12);
    });
    auto expected = numbers(16, 100);
    expected[1] = 3, expected[2] = 77, expected[3] = 77;
    EXPECT_EQ(read<uint32_t>(b, 16), expected);
}

TEST_F(DeviceTest, timestampsGrowAndSkippedSlotsRepeat) {
    const auto slow = compile(kSlow);
    const auto scratch = bufferFor<float>(4096);
    const auto stamped = device().submit([&](gpu::Commands& c) {
        c.timestamp(0);
        c.dispatch(slow, SlowPush{scratch.address(), 5000}, 4096);
        c.barrier();
        c.timestamp(1);
        c.dispatch(slow, SlowPush{scratch.address(), 5000}, 4096);
        c.timestamp(3);
    });
    device().submit([](gpu::Commands&) {});
    device().wait(device().submit([](gpu::Commands&) {}));
    const auto ms = device().timestamps(stamped);
    ASSERT_EQ(ms.size(), 4u);
    EXPECT_EQ(ms[0], 0);
    EXPECT_GT(ms[1], 0);
    EXPECT_EQ(ms[2], ms[1]);
    EXPECT_GT(ms[3], ms[2]);
    EXPECT_LT(ms[3], 10'000);
    device().submit([](gpu::Commands&) {});
    EXPECT_THROW(device().timestamps(stamped), Error);
}

TEST_F(DeviceTest, aFailedRecordingLeavesTheDeviceUsable) {
    const auto a = bufferOf(numbers(16, 0));
    EXPECT_THROW(device().submit([&](gpu::Commands& c) {
        c.fill(a, 0, 64, 1);
        throw std::runtime_error("changed my mind");
    }),
                 std::runtime_error);
    EXPECT_EQ(read<uint32_t>(a, 16), numbers(16, 0));
    device().submit([&](gpu::Commands& c) { c.fill(a, 0, 64, 1); });
    EXPECT_EQ(read<uint32_t>(a, 16), std::vector<uint32_t>(16, 1));
}

TEST_F(DeviceTest, dispatchesBeyondTheLimitsAreErrors) {
    const auto scale = compile(kScale);
    device().submit([&](gpu::Commands& c) {
        const std::vector<std::byte> push(260);
        EXPECT_THROW(c.dispatch(scale, push, 1), Error);
        EXPECT_THROW(c.dispatch(scale, ScalePush{}, 1, UINT32_MAX), Error);
    });
}

TEST_F(DeviceTest, aDeviceLeavesNothingBehind) {
    std::vector<std::string> messages;
    log::setSink([&](log::Level, std::string_view message) { messages.emplace_back(message); });
    {
        gpu::Device passing({.device = "auto", .validation = true});
        gpu::Buffer buffer = passing.createBuffer(1000, gpu::Memory::Device, "test");
        passing.submit([&](gpu::Commands& c) { c.fill(buffer, 0, 1000, 0); });
        passing.upload(buffer, 0, std::vector<std::byte>(1000)); // staged or not, it never leaves
        const auto image = passing.createImage(1, 1, VK_FORMAT_R8G8B8A8_UNORM, std::vector<std::byte>(4), {}, "test");
    }
    log::setSink({});
    EXPECT_TRUE(messages.empty()) << messages.front();
}

// ---- Choice of a device -----------------------------------------------------------------------------

TEST_F(DeviceTest, unknownDevicesAreNamedWithThoseThatExist) {
    for (const char* choice : {"no such device", "99", "", "4294967296"}) {
        const Error error = errorOf([&] { gpu::Device({.device = choice}); });
        EXPECT_EQ(error.fault(), Fault::Input);
        EXPECT_NE(error.problem().find(choice), std::string::npos);
        EXPECT_NE(error.hint().find(device().info().name), std::string::npos) << error.what();
    }
}

/// Sets an environment variable for a while.
struct Environment {
    const char* name;
    Environment(const char* variable, const char* value) : name(variable) { setenv(name, value, 1); }
    ~Environment() { unsetenv(name); }
};

TEST_F(DeviceTest, aMachineWithoutADriverIsToldSo) {
    const Environment none("VK_ICD_FILENAMES", "/nonexistent.json");
    EXPECT_TRUE(gpu::listDevices().empty());
    const Error error = errorOf([] { gpu::Device({}); });
    EXPECT_EQ(error.fault(), Fault::Input);
    EXPECT_NE(error.hint().find("mesa-vulkan-drivers"), std::string::npos) << error.what();
}

TEST_F(DeviceTest, validationThatIsNotInstalledIsAnError) {
    const Environment none("VK_LAYER_PATH", "/nonexistent"), asked("TRILUME_VALIDATION", "1");
    const Error error = errorOf([] { gpu::Device({}); });
    EXPECT_EQ(error.fault(), Fault::Input);
    EXPECT_NE(error.hint().find("vulkan-validationlayers"), std::string::npos) << error.what();
}

TEST_F(DeviceTest, aDeviceCanBeChosenByIndexAndName) {
    const auto devices = gpu::listDevices();
    ASSERT_FALSE(devices.empty());
    for (const auto& listed : devices) {
        if (!listed.missing.empty()) continue;
        EXPECT_EQ(gpu::Device({.device = std::to_string(listed.index)}).info().name, listed.name);
        EXPECT_EQ(gpu::Device({.device = listed.name}).info().name, listed.name);
    }
}

} // namespace
