#pragma once

#include "gpu/device.h"

#include <gtest/gtest.h>

#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace trilume::test {

/// One validated device for all tests of the program. Each test fails on any message of the validation layers.
class GpuTest : public testing::Test {
protected:
    static gpu::Device& device() {
        static gpu::Device shared({.device = "auto", .validation = true});
        return shared;
    }

    void SetUp() override { messagesBefore_ = device().validationMessages(); }
    void TearDown() override {
        device().waitIdle();
        EXPECT_EQ(device().validationMessages(), messagesBefore_) << "validation messages: see the log above";
    }

    /// Compiles and runs a compute shader given as text, and waits for it. `#version 460` and the include extension are
    /// put in front; includes are below shaders/, e.g. `#include "lib/math.glsl"`. `push` is the push-constant block.
    ///
    ///     layout(local_size_x = 64) in;
    ///     layout(push_constant, scalar) uniform Push { floatRef result; uint count; } push;
    ///     void main() { if (gl_GlobalInvocationID.x < push.count) push.result.v[gl_GlobalInvocationID.x] = 1; }
    template<class Push>
    void runCompute(const std::string& source, const Push& push, uint32_t threads,
                    std::vector<std::pair<std::string, std::string>> defines = {}) {
        const gpu::Pipeline pipeline = compile(source, std::move(defines));
        device().wait(device().submit([&](gpu::Commands& commands) { commands.dispatch(pipeline, push, threads); }));
    }

    gpu::Pipeline compile(const std::string& source, std::vector<std::pair<std::string, std::string>> defines = {}) {
        const auto* test = testing::UnitTest::GetInstance()->current_test_info();
        return device().createPipeline({.path = std::string(test->test_suite_name()) + "." + test->name(),
                                        .defines = std::move(defines),
                                        .text = "#version 460\n#extension GL_GOOGLE_include_directive : require\n"
                                                "#include \"shared/types.h\"\n#line 1\n" +
                                                source});
    }

    template<class T>
    gpu::Buffer bufferOf(const std::vector<T>& data) {
        return device().createBufferFrom(std::span<const T>(data), "test data");
    }
    template<class T>
    gpu::Buffer bufferFor(size_t count) {
        return device().createBuffer(count * sizeof(T), gpu::Memory::Device, "test result");
    }
    template<class T>
    std::vector<T> read(const gpu::Buffer& buffer, size_t count) {
        std::vector<T> data(count);
        device().download(buffer, 0, std::as_writable_bytes(std::span(data)));
        return data;
    }

private:
    uint32_t messagesBefore_ = 0;
};

} // namespace trilume::test
