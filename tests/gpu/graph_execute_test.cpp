// Compiled graphs on the device: real dispatches, memory that is taken over, history that swaps, validation on.

#include "core/clock.h"
#include "core/error.h"
#include "gpu/gpu_fixture.h"
#include "graph/execute.h"

#include <algorithm>

namespace trilume::test {
namespace {

using graph::Builder;
using graph::FrameContext;
using graph::History;
using graph::Plane;

constexpr uint32_t kWidth = 37, kHeight = 19;

/// result[i] = (a == 0 ? i : a[i]) * scale + (b == 0 ? 0 : b[i])
constexpr const char* kShader = R"(
#extension GL_EXT_buffer_reference_uvec2 : require
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { uvec2 a, b, result; uint count; float scale; } push;
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    float x = push.a == uvec2(0) ? float(i) : floatRef(push.a).v[i];
    floatRef(push.result).v[i] = x * push.scale + (push.b == uvec2(0) ? 0 : floatRef(push.b).v[i]);
}
)";

struct Push {
    VkDeviceAddress a, b, result;
    uint32_t count;
    float scale;
};

void combine(FrameContext& context, VkDeviceAddress a, VkDeviceAddress b, VkDeviceAddress result, float scale) {
    const uint32_t count = context.width * context.height;
    context.commands.dispatch(context.pipeline({}), Push{a, b, result, count, scale}, count);
}

/// name.x = scale * input + 0, where the input is another node's plane, or the pixel's index when there is none.
class Scale : public graph::Node {
public:
    Scale(std::string name, std::string input, float scale)
        : name_(std::move(name)), inputName_(std::move(input)), scale_(scale) {}
    void declare(Builder& builder) override {
        input_ = {};
        if (!inputName_.empty()) builder.read(input_ = builder.findPlane(inputName_));
        output_ = builder.createPlane(name_ + ".x", 4);
    }
    void execute(FrameContext& context) override {
        combine(context, context.resources.address(input_), 0, context.resources.address(output_), scale_);
    }

private:
    std::string name_, inputName_;
    float scale_;
    Plane input_, output_;
};

/// sum.x += input, over frames.
class Sum : public graph::Node {
public:
    explicit Sum(std::string input) : inputName_(std::move(input)) {}
    void declare(Builder& builder) override {
        builder.read(input_ = builder.findPlane(inputName_));
        sum_ = builder.historyPlane("sum.x", 4);
    }
    void execute(FrameContext& context) override {
        if (fails) throw runError("a node that fails", "sum", "none");
        const auto& r = context.resources;
        sawHistory = r.historyValid(sum_.previous);
        combine(context, r.address(input_), sawHistory ? r.address(sum_.previous) : 0, r.address(sum_.current), 1);
    }
    bool sawHistory = false, fails = false;

private:
    std::string inputName_;
    Plane input_;
    History<Plane> sum_;
};

/// Adds what it is given in place.
class InPlace : public graph::Node {
public:
    void declare(Builder& builder) override {
        first_ = builder.findPlane("first.x");
        builder.read(first_);
        target_ = builder.write(builder.findPlane("fourth.x"));
    }
    void execute(FrameContext& context) override {
        const VkDeviceAddress target = context.resources.address(target_);
        combine(context, target, context.resources.address(first_), target, 1);
    }

private:
    Plane first_, target_;
};

class GraphExecute : public GpuTest {
protected:
    void SetUp() override {
        GpuTest::SetUp();
        pipeline_ = compile(kShader);
    }
    void TearDown() override {
        pipeline_ = {};
        GpuTest::TearDown();
    }

    void compileGraph(uint32_t width, uint32_t height, const std::vector<std::string>& outputs) {
        executor_.setGraph(graph::compile({nodes_, facts_, params_, width, height, outputs}));
    }
    void frame() {
        const auto submission = device().submit([&](gpu::Commands& commands) {
            executor_.record(
                commands, {.nodes = nodes_,
                           .params = params_,
                           .facts = facts_,
                           .pipeline = [this](const gpu::ShaderSource&) -> const gpu::Pipeline& { return pipeline_; }});
        });
        device().wait(submission);
        times_ = executor_.passTimes(device().timestamps(submission));
    }
    std::vector<float> values(std::string_view name) {
        const graph::GraphExecutor::Region region = executor_.region(name);
        std::vector<float> data(region.bytes / sizeof(float));
        device().download(*region.buffer, region.offset, std::as_writable_bytes(std::span(data)));
        return data;
    }
    void expectScaledIndices(std::string_view name, float scale, size_t count = kWidth * kHeight) {
        const std::vector<float> data = values(name);
        ASSERT_EQ(data.size(), count);
        for (size_t i = 0; i < data.size(); ++i)
            ASSERT_EQ(data[i], scale * static_cast<float>(i)) << name << " at " << i;
    }

    gpu::Pipeline pipeline_;
    ParamTable table_;
    ParamSet params_{table_};
    graph::SceneFacts facts_;
    Scale first_{"first", "", 2}, second_{"second", "first.x", 3}, third_{"third", "second.x", 1},
        fourth_{"fourth", "third.x", 1};
    Sum sum_{"fourth.x"};
    std::vector<graph::GraphNode> nodes_{
        {"first", &first_}, {"second", &second_}, {"third", &third_}, {"fourth", &fourth_}, {"sum", &sum_}};
    graph::GraphExecutor executor_{device()};
    std::vector<double> times_;
};

TEST_F(GraphExecute, RunsInOrderInSharedMemory) {
    compileGraph(kWidth, kHeight, {"sum.x"});
    EXPECT_EQ(executor_.graph().find("third.x")->offset, executor_.graph().find("first.x")->offset);
    frame();
    expectScaledIndices("sum.x", 6);
    ASSERT_EQ(times_.size(), 5u);
    for (const double ms : times_) EXPECT_GE(ms, 0);
    EXPECT_GT(times_[0] + times_[1] + times_[2] + times_[3] + times_[4], 0);
}

TEST_F(GraphExecute, OutputsOutliveTheFrame) {
    compileGraph(kWidth, kHeight, {"first.x", "second.x", "sum.x"});
    frame();
    expectScaledIndices("first.x", 2);
    expectScaledIndices("second.x", 6);
}

TEST_F(GraphExecute, WritesInPlace) {
    InPlace inPlace;
    nodes_.insert(nodes_.begin() + 4, {"inPlace", &inPlace});
    compileGraph(kWidth, kHeight, {"sum.x"});
    frame();
    expectScaledIndices("sum.x", 8);
}

TEST_F(GraphExecute, HistoryAddsUpOverFramesAndRecompiles) {
    compileGraph(kWidth, kHeight, {"sum.x"});
    for (int i = 0; i < 3; ++i) frame();
    compileGraph(kWidth, kHeight, {"sum.x", "first.x"});
    for (int i = 0; i < 2; ++i) frame();
    expectScaledIndices("sum.x", 5 * 6);
}

TEST_F(GraphExecute, HistoryStartsAnewAfterResetResizeFailureAndAbsence) {
    const auto renderAndExpectFresh = [&](std::string_view after) {
        SCOPED_TRACE(after);
        frame();
        EXPECT_FALSE(sum_.sawHistory);
        expectScaledIndices("sum.x", 6, executor_.graph().width * executor_.graph().height);
        frame();
        EXPECT_TRUE(sum_.sawHistory);
    };
    compileGraph(kWidth, kHeight, {"sum.x"});
    renderAndExpectFresh("the start");
    executor_.resetHistory();
    renderAndExpectFresh("a reset");
    compileGraph(kHeight, kWidth, {"sum.x"});
    renderAndExpectFresh("a resize");
    sum_.fails = true;
    EXPECT_THROW(frame(), Error);
    sum_.fails = false;
    renderAndExpectFresh("a frame that failed");
    nodes_[4].enabled = false;
    compileGraph(kHeight, kWidth, {"sum.x", "first.x"});
    frame();
    nodes_[4].enabled = true;
    compileGraph(kHeight, kWidth, {"sum.x"});
    renderAndExpectFresh("a frame without its writer");
}

TEST_F(GraphExecute, MemoryFollowsTheGraph) {
    compileGraph(kWidth, kHeight, {"sum.x"});
    const size_t held = executor_.memoryBytes();
    compileGraph(kWidth, kHeight, {"sum.x"});
    EXPECT_EQ(executor_.memoryBytes(), held);
    compileGraph(4 * kWidth, 4 * kHeight, {"sum.x"});
    EXPECT_GT(executor_.memoryBytes(), 12 * held);
    compileGraph(kWidth, kHeight, {"sum.x"});
    EXPECT_EQ(executor_.memoryBytes(), held);
    compileGraph(kWidth, kHeight, {});
    EXPECT_EQ(executor_.memoryBytes(), 0u) << "nothing is needed";
    EXPECT_FALSE(executor_.region("sum.x"));
}

TEST_F(GraphExecute, AResourceThatWasNotDeclaredIsRefused) {
    class Thief : public graph::Node {
    public:
        void declare(Builder& builder) override {
            stolen_ = builder.findPlane("first.x");
            builder.sideEffect();
        }
        void execute(FrameContext& context) override { (void)context.resources.address(stolen_); }

    private:
        Plane stolen_;
    } thief;
    nodes_.push_back({"thief", &thief});
    compileGraph(kWidth, kHeight, {"sum.x"});
    try {
        frame();
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.where(), "thief, first.x");
    }
}

TEST_F(GraphExecute, CompilingEachFrameIsAffordable) {
    std::vector<std::unique_ptr<Scale>> chain;
    for (int i = 0; i < 15; ++i) {
        const std::string name = "n" + std::to_string(i);
        chain.push_back(std::make_unique<Scale>(name, i == 0 ? "sum.x" : "n" + std::to_string(i - 1) + ".x", 1));
        nodes_.push_back({name, chain.back().get()});
    }
    std::vector<double> compileMs, recordMs;
    for (int i = 0; i < 101; ++i) {
        Stopwatch watch;
        compileGraph(kWidth, kHeight, {"n14.x"});
        compileMs.push_back(watch.restart());
        device().wait(device().submit([&](gpu::Commands& commands) {
            watch.restart();
            executor_.record(
                commands, {.nodes = nodes_,
                           .params = params_,
                           .facts = facts_,
                           .pipeline = [this](const gpu::ShaderSource&) -> const gpu::Pipeline& { return pipeline_; }});
            recordMs.push_back(watch.ms());
        }));
    }
    std::nth_element(compileMs.begin(), compileMs.begin() + 50, compileMs.end());
    std::nth_element(recordMs.begin(), recordMs.begin() + 50, recordMs.end());
    RecordProperty("compileMs", std::to_string(compileMs[50]));
    RecordProperty("recordMs", std::to_string(recordMs[50]));
    // Validation layers take part in record, so only what the graph does alone is held to the target of 0.3 ms a frame.
    EXPECT_LT(compileMs[50], 0.3);
}

} // namespace
} // namespace trilume::test
