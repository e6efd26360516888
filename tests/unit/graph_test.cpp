// The compile step and the history logic of the render graph, with fake nodes and no GPU.

#include "core/error.h"
#include "graph/arena.h"
#include "graph/compile.h"
#include "graph/dump.h"
#include "graph/history.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <random>

using namespace trilume;
using namespace trilume::graph;

namespace {

/// A node from two functions.
class FakeNode final : public Node {
public:
    using Declare = std::function<void(Builder&)>;
    explicit FakeNode(Declare declare, Need need = Need::yes())
        : declare_(std::move(declare)), need_(std::move(need)) {}
    Need needed(const SceneFacts&, const ParamSet&) const override { return need_; }
    void declare(Builder& builder) override { declare_(builder); }
    void execute(FrameContext&) override {}

private:
    Declare declare_;
    Need need_;
};

/// A technique under construction, 64 x 32 pixels.
class FakeGraph {
public:
    FakeGraph& node(std::string name, FakeNode::Declare declare, Need need = Need::yes()) {
        owned_.push_back(std::make_shared<FakeNode>(std::move(declare), std::move(need)));
        nodes_.push_back({.name = std::move(name), .node = owned_.back().get()});
        return *this;
    }
    FakeGraph& disable(std::string_view name) {
        for (GraphNode& n : nodes_)
            if (n.name == name) n.enabled = false;
        return *this;
    }
    FakeGraph& output(std::string name) {
        outputs_.push_back(std::move(name));
        return *this;
    }
    FakeGraph& overlapping() {
        overlapping_ = true;
        return *this;
    }
    CompiledGraph compile(uint32_t width = 64, uint32_t height = 32) const {
        const ParamTable table;
        const ParamSet params(table);
        const SceneFacts facts;
        return graph::compile({nodes_, facts, params, width, height, outputs_, overlapping_});
    }
    /// The error of a graph that must not compile.
    Error error() const {
        try {
            compile();
        } catch (const Error& e) {
            return e;
        }
        throw std::logic_error("the graph compiled");
    }

private:
    std::vector<std::shared_ptr<FakeNode>> owned_;
    std::vector<GraphNode> nodes_;
    std::vector<std::string> outputs_;
    bool overlapping_ = false;
};

FakeNode::Declare creates(std::string name, uint32_t bytesPerPixel = 4) {
    return [=](Builder& b) { (void)b.createPlane(name, bytesPerPixel); };
}
FakeNode::Declare readsAndCreates(std::string from, std::string to) {
    return [=](Builder& b) {
        b.read(b.findPlane(from));
        (void)b.createPlane(to, 4);
    };
}

const Pass& pass(const CompiledGraph& graph, std::string_view name) {
    return *std::find_if(graph.passes.begin(), graph.passes.end(), [&](const Pass& p) { return p.name == name; });
}

/// "kind resource behind" for each hazard before a pass.
std::vector<std::string> hazards(const CompiledGraph& graph, std::string_view name) {
    std::vector<std::string> out;
    for (const Hazard& h : pass(graph, name).barrierBefore)
        out.push_back(std::string(hazardName(h.kind)) + " " + graph.resources[h.resource].name + " " +
                      graph.resources[h.behind].name);
    return out;
}
using Strings = std::vector<std::string>;

bool contains(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

// ---- order, sizes, states ----

TEST(Compile, KeepsOrderAndGivesSizes) {
    const CompiledGraph graph = FakeGraph()
                                    .node("a", creates("a.x", 16))
                                    .node("b", readsAndCreates("a.x", "b.y"))
                                    .output("b.y")
                                    .compile(64, 32);
    ASSERT_EQ(graph.passes.size(), 2u);
    EXPECT_EQ(graph.passes[0].name, "a");
    EXPECT_TRUE(graph.passes[0].runs() && graph.passes[1].runs());
    EXPECT_EQ(graph.find("a.x")->bytes, 64u * 32 * 16);
    EXPECT_EQ(graph.find("a.x")->lastUse, 1u);
    EXPECT_EQ(graph.find("b.y")->lastUse, 2u) << "an output outlives the last pass";
    EXPECT_EQ(graph.find("c.z"), nullptr);
}

TEST(Compile, ReportsOutputsThatNobodyMakes) {
    const CompiledGraph graph =
        FakeGraph().node("a", creates("a.x")).output("a.x").output("caustics.radiance").compile();
    EXPECT_EQ(graph.missingOutputs, Strings{"caustics.radiance"});
}

TEST(Compile, AnEmptyTechniqueCompiles) {
    const CompiledGraph graph = FakeGraph().compile();
    EXPECT_TRUE(graph.passes.empty());
    EXPECT_EQ(graph.arenaBytes, 0u);
    EXPECT_EQ(graph.unowned.size(), static_cast<size_t>(PathClass::Count));
}

TEST(Compile, FindsPlanesBySuffixInOrder) {
    std::vector<size_t> counts;
    Strings names;
    FakeGraph graph;
    graph.node("a", creates("a.radiance")).node("b", [](Builder& b) {
        (void)b.createPlane("b.radiance", 8);
        (void)b.createBuffer("b.buffer.radiance", 8);
        (void)b.historyPlane("b.radianceHistory", 8);
    });
    graph.node("c", [&](Builder& b) {
        for (const Plane p : b.findPlanes(".radiance")) {
            b.read(p);
            counts.push_back(p.resource);
        }
        b.sideEffect();
    });
    EXPECT_TRUE(pass(graph.compile(), "b").runs());
    EXPECT_EQ(counts, (std::vector<size_t>{0, 1}));
}

// ---- culling ----

TEST(Culling, SaysWhyForEachState) {
    const CompiledGraph graph = FakeGraph()
                                    .node("a", creates("a.x"))
                                    .node("off", creates("off.x"))
                                    .node("idle", creates("idle.x"), Need::no("no specular casters"))
                                    .node("lonely", creates("lonely.x"))
                                    .disable("off")
                                    .output("a.x")
                                    .compile();
    EXPECT_TRUE(pass(graph, "a").runs());
    EXPECT_EQ(pass(graph, "off").state, PassState::Disabled);
    EXPECT_EQ(pass(graph, "off").reason, "disabled");
    EXPECT_EQ(pass(graph, "idle").state, PassState::NotNeeded);
    EXPECT_EQ(pass(graph, "idle").reason, "no specular casters");
    EXPECT_EQ(pass(graph, "lonely").state, PassState::Unused);
    EXPECT_EQ(pass(graph, "lonely").reason, "unused: nothing reads lonely.x");
    EXPECT_FALSE(graph.resources[1].used) << "what is culled has no memory";
}

TEST(Culling, CascadesUpwardsToWhatOnlyACulledNodeNeeds) {
    const CompiledGraph graph = FakeGraph()
                                    .node("a", creates("a.x"))
                                    .node("b", readsAndCreates("a.x", "b.x"))
                                    .node("c", readsAndCreates("b.x", "c.x"))
                                    .node("d", creates("d.x"))
                                    .output("d.x")
                                    .compile();
    EXPECT_EQ(pass(graph, "a").reason, "unused: only b uses a.x, and it does not run");
    EXPECT_EQ(pass(graph, "b").reason, "unused: only c uses b.x, and it does not run");
    EXPECT_EQ(pass(graph, "c").reason, "unused: nothing reads c.x");
}

TEST(Culling, CascadesDownwardsByTheNodesOwnChoice) {
    const auto optional = [](Builder& b) {
        if (const Plane p = b.findPlane("a.x")) {
            b.read(p);
            (void)b.createPlane("b.x", 4);
        }
    };
    FakeGraph graph;
    graph.node("a", creates("a.x")).node("b", optional).node("c", [](Builder& b) { b.sideEffect(); });
    EXPECT_EQ(pass(graph.output("b.x").compile(), "b").state, PassState::Run);
    const CompiledGraph without = graph.disable("a").compile();
    EXPECT_EQ(pass(without, "b").state, PassState::Unused);
    EXPECT_EQ(pass(without, "b").reason, "a.x is missing: a is disabled");
    EXPECT_TRUE(pass(without, "c").runs()) << "a side effect is never culled";
}

TEST(Culling, KeepsEveryWriterOfAVersionThatIsRead) {
    const auto modifies = [](Builder& b) { (void)b.write(b.findPlane("a.x")); };
    FakeGraph graph;
    graph.node("a", creates("a.x")).node("b", modifies).node("c", modifies).output("a.x");
    for (const Pass& p : graph.compile().passes) EXPECT_TRUE(p.runs()) << p.name;
}

TEST(Culling, AWriterBehindTheLastReaderIsUnused) {
    const CompiledGraph graph = FakeGraph()
                                    .node("a", creates("a.x"))
                                    .node("b", readsAndCreates("a.x", "b.x"))
                                    .node("c", [](Builder& b) { (void)b.write(b.findPlane("a.x")); })
                                    .output("b.x")
                                    .compile();
    EXPECT_TRUE(pass(graph, "a").runs());
    EXPECT_EQ(pass(graph, "c").state, PassState::Unused);
    EXPECT_EQ(graph.find("a.x")->lastUse, 1u);
}

TEST(Culling, KeepsWhoWritesTheHistoryThatTheNextFrameReads) {
    FakeGraph graph;
    graph.node("a", [](Builder& b) { (void)b.historyPlane("a.h", 4); })
        .node("b",
              [](Builder& b) {
                  b.read(b.findPlane("a.h.previous"));
                  (void)b.createPlane("b.x", 4);
              })
        .node("feedback", [](Builder& b) { (void)b.write(b.findPlane("a.h")); });
    for (const Pass& p : graph.compile().passes) EXPECT_FALSE(p.runs()) << "its own history keeps nobody alive";
    for (const Pass& p : graph.output("b.x").compile().passes) EXPECT_TRUE(p.runs()) << p.name;
}

// ---- misuse ----

TEST(Misuse, ReadingARetiredVersion) {
    Plane stale;
    const Error e = FakeGraph()
                        .node("a", creates("a.x"))
                        .node("b",
                              [&](Builder& b) {
                                  stale = b.findPlane("a.x");
                                  (void)b.write(stale);
                              })
                        .node("c", [&](Builder& b) { b.read(stale); })
                        .error();
    EXPECT_EQ(e.fault(), Fault::Run);
    EXPECT_EQ(e.where(), "c, a.x");
    EXPECT_TRUE(contains(e.problem(), "reads a retired version")) << e.what();
    EXPECT_TRUE(contains(e.hint(), "b has written it since")) << e.what();
}

TEST(Misuse, WritingARetiredVersion) {
    const Error e = FakeGraph()
                        .node("a",
                              [](Builder& b) {
                                  const Plane first = b.createPlane("a.x", 4);
                                  (void)b.write(first);
                                  (void)b.write(first);
                              })
                        .error();
    EXPECT_TRUE(contains(e.problem(), "writes a retired version")) << e.what();
}

TEST(Misuse, ReadingWhatNobodyWrote) {
    const Error e = FakeGraph().node("b", readsAndCreates("a.x", "b.x")).error();
    EXPECT_EQ(e.fault(), Fault::Run);
    EXPECT_EQ(e.where(), "b, a.x");
    EXPECT_TRUE(contains(e.hint(), "no node makes it")) << e.what();
}

TEST(Misuse, ReadingWhatADisabledNodeWouldWriteIsTheUsersFault) {
    const Error e = FakeGraph().node("a", creates("a.x")).node("b", readsAndCreates("a.x", "b.x")).disable("a").error();
    EXPECT_EQ(e.fault(), Fault::Input);
    EXPECT_TRUE(contains(e.hint(), "a is disabled")) << e.what();
}

TEST(Misuse, ReadingABufferAsAPlane) {
    const Error e = FakeGraph()
                        .node("a", [](Builder& b) { (void)b.createBuffer("a.x", 64); })
                        .node("b", readsAndCreates("a.x", "b.x"))
                        .error();
    EXPECT_TRUE(contains(e.hint(), "it is a buffer")) << e.what();
}

TEST(Misuse, CreatingANameTwice) {
    const Error e = FakeGraph().node("a", creates("x.x")).node("b", creates("x.x")).error();
    EXPECT_EQ(e.where(), "b, x.x");
    EXPECT_TRUE(contains(e.hint(), "a made it first")) << e.what();
}

TEST(Misuse, WritingAnUnknownHandle) {
    for (const Plane handle : {Plane{}, Plane{7, 1}, Plane{0, 9}}) {
        const Error e = FakeGraph()
                            .node("a",
                                  [&](Builder& b) {
                                      (void)b.createPlane("a.x", 4);
                                      (void)b.write(handle);
                                  })
                            .error();
        EXPECT_TRUE(contains(e.problem(), "writes an unknown handle")) << e.what();
    }
}

TEST(Misuse, WritingLastFrame) {
    const Error e = FakeGraph().node("a", [](Builder& b) { (void)b.write(b.historyPlane("a.h", 4).previous); }).error();
    EXPECT_EQ(e.where(), "a, a.h.previous");
}

TEST(Misuse, AllNodesErrorsComeAsOne) {
    const Error e = FakeGraph()
                        .node("a", creates("x"))
                        .node("b", creates("x"))
                        .node("c", readsAndCreates("nobody.y", "c.y"))
                        .error();
    EXPECT_EQ(e.where(), "b, x");
    EXPECT_TRUE(contains(e.hint(), "also c, nobody.y: the node reads a resource that nobody wrote")) << e.what();
    EXPECT_FALSE(contains(e.what(), "\n"));
}

TEST(Misuse, ListingANodeTwice) {
    EXPECT_EQ(FakeGraph().node("a", creates("a.x")).node("a", creates("a.y")).error().where(), "a");
}

// ---- path classes ----

FakeNode::Declare owner(std::string name, std::vector<PathClass> classes) {
    return [=](Builder& b) {
        (void)b.createPlane(name, 4);
        for (const PathClass c : classes) b.owns(c);
    };
}

TEST(PathClasses, OneOwnerEachAndTheRestReported) {
    const CompiledGraph graph = FakeGraph()
                                    .node("visibility", owner("v.x", {PathClass::Emission}))
                                    .node("raytrace", owner("r.x", {PathClass::Direct}))
                                    .output("v.x")
                                    .output("r.x")
                                    .compile();
    EXPECT_EQ(graph.owners[0], 0u);
    EXPECT_EQ(graph.owners[1], 1u);
    EXPECT_EQ(graph.unowned, (std::vector{PathClass::Caustic, PathClass::Indirect}));
    EXPECT_STREQ(pathClassName(graph.unowned[0]), "caustic");
}

TEST(PathClasses, TwoOwnersDontCompile) {
    FakeGraph graph;
    graph.node("restir_di", owner("d.x", {PathClass::Direct}))
        .node("raytrace", owner("r.x", {PathClass::Direct}))
        .output("d.x")
        .output("r.x");
    const Error e = graph.error();
    EXPECT_EQ(e.fault(), Fault::Input);
    EXPECT_EQ(e.where(), "restir_di and raytrace");
    EXPECT_TRUE(contains(e.problem(), "direct")) << e.what();
    EXPECT_NO_THROW(FakeGraph(graph).overlapping().compile());
    EXPECT_NO_THROW(graph.disable("raytrace").compile());
}

TEST(PathClasses, ACulledNodeOwnsNothing) {
    const CompiledGraph graph = FakeGraph()
                                    .node("a", owner("a.x", {PathClass::Direct}))
                                    .node("b", owner("b.x", {PathClass::Direct}))
                                    .output("b.x")
                                    .compile();
    EXPECT_EQ(graph.owners[1], 1u);
}

TEST(PathClasses, WhatTheSceneDoesNotHaveIsNotMissing) {
    const CompiledGraph graph = FakeGraph()
                                    .node("direct", owner("d.x", {PathClass::Direct}))
                                    .node("caustics", owner("c.x", {PathClass::Caustic}), Need::no("no casters"))
                                    .node("other", owner("o.x", {PathClass::Direct}), Need::no("the first does it"))
                                    .output("d.x")
                                    .compile();
    EXPECT_EQ(graph.unneeded, (std::vector{PathClass::Caustic}));
    EXPECT_EQ(graph.unowned, (std::vector{PathClass::Emission, PathClass::Indirect}));
}

// ---- hazards ----

TEST(Hazards, EachKindNamesItsResource) {
    const CompiledGraph graph = FakeGraph()
                                    .node("a", creates("a.x"))
                                    .node("b", readsAndCreates("a.x", "b.x"))
                                    .node("c", [](Builder& b) { (void)b.write(b.findPlane("a.x")); })
                                    .node("d", [](Builder& b) { (void)b.write(b.findPlane("a.x")); })
                                    .output("a.x")
                                    .output("b.x")
                                    .compile();
    EXPECT_EQ(hazards(graph, "a"), Strings{});
    EXPECT_EQ(hazards(graph, "b"), Strings{"read-after-write a.x a.x"});
    EXPECT_EQ(hazards(graph, "c"), Strings{"write-after-read a.x a.x"});
    EXPECT_EQ(hazards(graph, "d"), Strings{"write-after-write a.x a.x"});
}

TEST(Hazards, IndependentPassesDontWaitAndOneBarrierServesAll) {
    const CompiledGraph graph = FakeGraph()
                                    .node("a", creates("a.x"))
                                    .node("b", creates("b.x"))
                                    .node("c", readsAndCreates("a.x", "c.x"))
                                    .node("d", readsAndCreates("b.x", "d.x"))
                                    .output("a.x") // else d.x would take its place, and wait
                                    .output("c.x")
                                    .output("d.x")
                                    .compile();
    EXPECT_EQ(hazards(graph, "b"), Strings{});
    EXPECT_EQ(hazards(graph, "c"), Strings{"read-after-write a.x a.x"});
    EXPECT_EQ(hazards(graph, "d"), Strings{}) << "the barrier before c ordered b as well";
}

TEST(Hazards, LastFramesHalfNeedsNoBarrier) {
    const CompiledGraph graph = FakeGraph()
                                    .node("a", [](Builder& b) { (void)b.historyPlane("a.h", 4); })
                                    .node("b", readsAndCreates("a.h.previous", "b.x"))
                                    .output("b.x")
                                    .compile();
    EXPECT_EQ(hazards(graph, "b"), Strings{});
}

TEST(Hazards, TakingOverMemoryWaitsForItsLastUse) {
    const CompiledGraph graph = FakeGraph()
                                    .node("a", creates("a.x"))
                                    .node("b", readsAndCreates("a.x", "b.x"))
                                    .node("c", creates("c.x"))
                                    .node("d",
                                          [](Builder& b) {
                                              b.read(b.findPlane("b.x"));
                                              b.read(b.findPlane("c.x"));
                                              b.sideEffect();
                                          })
                                    .compile();
    ASSERT_EQ(graph.find("c.x")->offset, graph.find("a.x")->offset) << "c.x takes the place of a.x";
    EXPECT_EQ(hazards(graph, "c"), Strings{"write-after-read c.x a.x"});
    EXPECT_EQ(graph.arenaBytes, 2u * 64 * 32 * 4);
}

// ---- aliasing ----

TEST(Arena, BlocksThatMeetInAPassDontShare) {
    Block blocks[] = {{1000, 0, 1}, {1000, 1, 2}, {1000, 2, 3}};
    EXPECT_EQ(placeInArena(blocks), 2048u);
    EXPECT_EQ(blocks[0].offset, blocks[2].offset);
    EXPECT_NE(blocks[0].offset, blocks[1].offset);
}

TEST(Arena, FillsGapsAndHandlesEmptyBlocks) {
    Block blocks[] = {{4096, 0, 0}, {1024, 1, 1}, {1024, 1, 1}, {0, 1, 1}, {0, 0, 0}};
    EXPECT_EQ(placeInArena(blocks), 4096u + 256u);
    EXPECT_EQ(placeInArena({}), 0u);
}

TEST(Arena, RandomBlocksNeverOverlapWhileAlive) {
    std::mt19937 random(7);
    for (int round = 0; round < 200; ++round) {
        std::vector<Block> blocks(random() % 40);
        size_t total = 0, largest = 0;
        for (Block& b : blocks) {
            b.bytes = random() % 10000;
            b.first = random() % 20;
            b.last = b.first + random() % 6;
            total += b.bytes + kArenaAlignment;
            largest = std::max(largest, b.bytes);
        }
        const size_t arena = placeInArena(blocks);
        EXPECT_LE(arena, total);
        EXPECT_GE(arena, largest);
        for (size_t i = 0; i < blocks.size(); ++i) {
            const Block& a = blocks[i];
            EXPECT_EQ(a.offset % kArenaAlignment, 0u);
            EXPECT_LE(a.offset + a.bytes, arena);
            for (size_t j = 0; j < i; ++j) {
                const Block& b = blocks[j];
                const bool together = a.first <= b.last && b.first <= a.last;
                const bool apart = a.offset + a.bytes <= b.offset || b.offset + b.bytes <= a.offset;
                EXPECT_TRUE(!together || apart) << "round " << round << ", blocks " << i << " and " << j;
            }
        }
    }
}

std::string numbered(unsigned n, std::string_view suffix = "") {
    return std::string("n").append(std::to_string(n)).append(suffix);
}

/// A random technique: each node makes a plane, reads some and modifies some of what there is.
FakeGraph randomGraph(std::mt19937& random) {
    FakeGraph graph;
    const unsigned count = 2 + random() % 12;
    for (unsigned n = 0; n < count; ++n) {
        const unsigned seed = random();
        graph.node(numbered(n), [n, seed](Builder& b) {
            std::mt19937 choose(seed);
            for (const Plane p : b.findPlanes(".x")) {
                if (choose() % 3 == 0)
                    b.read(p);
                else if (choose() % 6 == 0)
                    (void)b.write(p);
            }
            (void)b.createPlane(numbered(n, ".x"), 4 << (choose() % 3));
            if (choose() % 4 == 0) {
                const History<Plane> h = b.historyPlane(numbered(n, ".h"), 4);
                b.read(h.previous);
            }
            if (choose() % 8 == 0) b.sideEffect();
        });
    }
    return graph.output(numbered(count - 1, ".x"));
}

/// Two accesses conflict when they touch the same bytes and one writes.
bool conflict(const CompiledGraph& graph, const Access& a, const Access& b) {
    if (!a.writes && !b.writes) return false;
    if (a.resource == b.resource) return true;
    const ResourceInfo &x = graph.resources[a.resource], &y = graph.resources[b.resource];
    return x.role == HistoryRole::None && y.role == HistoryRole::None && x.offset < y.offset + y.bytes &&
           y.offset < x.offset + x.bytes;
}

TEST(RandomGraphs, ConflictingPassesHaveABarrierBetweenThemAndLiveMemoryIsNeverShared) {
    std::mt19937 random(11);
    size_t conflicts = 0, aliases = 0, needless = 0;
    for (int round = 0; round < 300; ++round) {
        const CompiledGraph graph = randomGraph(random).compile(16, 16);
        for (uint32_t later = 0; later < graph.passes.size(); ++later) {
            const Pass& b = graph.passes[later];
            for (uint32_t earlier = 0; earlier < later; ++earlier)
                for (const Access& x : graph.passes[earlier].accesses)
                    for (const Access& y : b.accesses) {
                        if (!conflict(graph, x, y)) continue;
                        ++conflicts;
                        aliases += x.resource != y.resource;
                        bool ordered = false;
                        for (uint32_t p = earlier + 1; p <= later; ++p)
                            ordered |= !graph.passes[p].barrierBefore.empty();
                        EXPECT_TRUE(ordered)
                            << "round " << round << ": " << graph.passes[earlier].name << ", " << b.name;
                    }
            for (const Hazard& h : b.barrierBefore) {
                const bool real = std::any_of(b.accesses.begin(), b.accesses.end(), [&](const Access& y) {
                    const auto& before = graph.passes[h.pass].accesses;
                    return std::any_of(before.begin(), before.end(),
                                       [&](const Access& x) { return conflict(graph, x, y); });
                });
                needless += !real;
            }
        }
        for (const ResourceInfo& a : graph.resources)
            for (const ResourceInfo& b : graph.resources) {
                if (&a == &b || !a.used || !b.used || a.role != HistoryRole::None || b.role != HistoryRole::None)
                    continue;
                if (a.firstUse > b.lastUse || b.firstUse > a.lastUse) continue;
                EXPECT_TRUE(a.offset + a.bytes <= b.offset || b.offset + b.bytes <= a.offset)
                    << a.name << ", " << b.name;
            }
    }
    EXPECT_GT(conflicts, 1000u) << "the random graphs must exercise what they test";
    EXPECT_GT(aliases, 100u);
    EXPECT_EQ(needless, 0u);
}

TEST(RandomGraphs, ACulledPassIsNeededByNobody) {
    std::mt19937 random(13);
    size_t culled = 0;
    for (int round = 0; round < 200; ++round) {
        const CompiledGraph graph = randomGraph(random).compile(16, 16);
        std::vector<bool> written(graph.resources.size());
        for (const Pass& p : graph.passes) {
            culled += !p.runs();
            EXPECT_EQ(p.runs(), p.reason.empty());
            for (const Access& a : p.accesses) {
                EXPECT_TRUE(p.runs());
                const bool lastFrames = graph.resources[a.resource].role == HistoryRole::Previous;
                if (a.reads && !a.writes && !lastFrames) {
                    EXPECT_TRUE(written[a.resource]) << p.name;
                }
                if (a.writes) written[a.resource] = true;
            }
        }
    }
    EXPECT_GT(culled, 100u);
}

// ---- history ----

CompiledGraph withHistory(uint32_t width = 8, uint32_t height = 8, uint32_t bytesPerPixel = 4, size_t buffer = 64) {
    return FakeGraph()
        .node("a",
              [=](Builder& b) {
                  (void)b.historyPlane("a.plane", bytesPerPixel);
                  (void)b.historyBuffer("a.buffer", buffer);
                  b.sideEffect();
              })
        .compile(width, height);
}

/// One complete frame; returns whether the plane's last frame was valid in it.
bool frame(HistoryTracker& history) {
    history.beginFrame();
    const bool valid = history.valid("a.plane");
    history.endFrame();
    return valid;
}

TEST(History, InvalidFirstThenValidAndSwapping) {
    HistoryTracker history;
    history.adopt(withHistory());
    EXPECT_FALSE(frame(history));
    const uint32_t first = history.currentHalf("a.plane");
    EXPECT_TRUE(frame(history));
    EXPECT_NE(history.currentHalf("a.plane"), first);
    EXPECT_TRUE(frame(history));
    EXPECT_EQ(history.currentHalf("a.plane"), first);
}

TEST(History, LivesOnAcrossARecompileWithTheSameSize) {
    HistoryTracker history;
    history.adopt(withHistory());
    frame(history);
    const uint32_t half = history.currentHalf("a.plane");
    history.adopt(withHistory());
    EXPECT_TRUE(frame(history));
    EXPECT_NE(history.currentHalf("a.plane"), half);
}

TEST(History, AResizeInvalidatesPlanesEvenWithEqualBytesButNotBuffers) {
    HistoryTracker history;
    history.adopt(withHistory(8, 8));
    frame(history);
    history.adopt(withHistory(16, 4));
    history.beginFrame();
    EXPECT_FALSE(history.valid("a.plane"));
    EXPECT_TRUE(history.valid("a.buffer"));
}

TEST(History, APersistentBufferIsValidAfterItsFirstFrameAndTakesMemoryOnce) {
    const CompiledGraph graph = FakeGraph()
                                    .node("a",
                                          [](Builder& b) {
                                              (void)b.persistentBuffer("a.state", 64);
                                              b.sideEffect();
                                          })
                                    .compile();
    EXPECT_EQ(graph.historyBytes, 64u);
    HistoryTracker history;
    history.adopt(graph);
    for (const bool valid : {false, true, true}) {
        history.beginFrame();
        EXPECT_EQ(history.valid("a.state"), valid);
        history.endFrame();
    }
    history.adopt(FakeGraph().compile());
    history.adopt(graph);
    history.beginFrame();
    EXPECT_FALSE(history.valid("a.state")) << "its node did not run in between";
}

TEST(History, AChangedSizeInvalidates) {
    HistoryTracker history;
    history.adopt(withHistory());
    frame(history);
    history.adopt(withHistory(8, 8, 8, 128));
    history.beginFrame();
    EXPECT_FALSE(history.valid("a.plane"));
    EXPECT_FALSE(history.valid("a.buffer"));
}

TEST(History, AFrameWithoutItsWriterInvalidates) {
    HistoryTracker history;
    history.adopt(withHistory());
    frame(history);
    history.adopt(FakeGraph().compile());
    history.beginFrame();
    history.endFrame();
    history.adopt(withHistory());
    EXPECT_FALSE(frame(history));
    EXPECT_TRUE(frame(history));
}

TEST(History, AFrameThatWasNotCompletedInvalidates) {
    HistoryTracker history;
    history.adopt(withHistory());
    frame(history);
    history.beginFrame(); // a node throws
    EXPECT_FALSE(frame(history));
    EXPECT_TRUE(frame(history));
}

TEST(History, ResetInvalidatesOneFrame) {
    HistoryTracker history;
    history.adopt(withHistory());
    frame(history);
    history.reset();
    EXPECT_FALSE(frame(history));
    EXPECT_TRUE(frame(history));
}

TEST(History, PairsStayOutOfTheArena) {
    const CompiledGraph graph = withHistory(8, 8, 4, 100);
    EXPECT_EQ(graph.arenaBytes, 0u);
    EXPECT_EQ(graph.historyBytes, 2u * (8 * 8 * 4 + 100));
}

// ---- dumps ----

CompiledGraph dumpSample() {
    return FakeGraph()
        .node("a", owner("a.x", {PathClass::Emission}))
        .node("b",
              [](Builder& b) {
                  b.read(b.findPlane("a.x"));
                  (void)b.historyPlane("b.h", 4);
              })
        .node("off", creates("off.x"), Need::no("no \"glass\" here"))
        .output("b.h")
        .compile();
}

TEST(Dump, JsonParsesAndTellsAll) {
    const nlohmann::json dump = nlohmann::json::parse(toJson(dumpSample()));
    EXPECT_EQ(dump["passes"].size(), 3u);
    EXPECT_EQ(dump["passes"][1]["reads"], (Strings{"a.x", "b.h.previous"}));
    EXPECT_EQ(dump["passes"][1]["barrier"][0]["kind"], "read-after-write");
    EXPECT_EQ(dump["passes"][2]["state"], "not needed");
    EXPECT_EQ(dump["passes"][2]["reason"], "no \"glass\" here");
    EXPECT_EQ(dump["resources"][0]["offset"], 0);
    EXPECT_EQ(dump["resources"][0]["lastUse"], 1);
    EXPECT_EQ(dump["owners"]["emission"], "a");
    EXPECT_EQ(dump["unowned"], (Strings{"direct", "caustic", "indirect"}));
}

TEST(Dump, DotIsWellFormed) {
    const std::string dot = toDot(dumpSample());
    EXPECT_TRUE(dot.starts_with("digraph frame {"));
    EXPECT_TRUE(contains(dot, "n0 -> n1 [label=\"a.x\"]"));
    EXPECT_TRUE(contains(dot, "n1 -> n1 [label=\"b.h.previous\", style=dotted"));
    EXPECT_TRUE(contains(dot, "no \\\"glass\\\" here"));
    size_t quotes = 0;
    for (size_t i = 0; i < dot.size(); ++i) quotes += dot[i] == '"' && dot[i - 1] != '\\';
    EXPECT_EQ(quotes % 2, 0u);
    EXPECT_EQ(std::count(dot.begin(), dot.end(), '{'), std::count(dot.begin(), dot.end(), '}'));
}

} // namespace
