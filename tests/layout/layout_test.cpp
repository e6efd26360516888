// Every struct of shaders/shared has the same layout in C++ and in SPIR-V.

#include "layout/spirv_layout.h"

#include "core/file.h"
#include "gpu/shader_compiler.h"

#include "shared/bpt.h"
#include "shared/bvh.h"
#include "shared/caustics.h"
#include "shared/ddgi.h"
#include "shared/denoise.h"
#include "shared/frame.h"
#include "shared/light.h"
#include "shared/material.h"
#include "shared/passes.h"
#include "shared/restir_di.h"
#include "shared/scene.h"
#include "shared/visibility.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <regex>
#include <set>

using namespace trilume;
using trilume::test::StructLayout;

namespace {

// clang-format off
#define TL_PARENTHESES ()
#define TL_EXPAND(...) TL_EXPAND3(TL_EXPAND3(TL_EXPAND3(TL_EXPAND3(__VA_ARGS__))))
#define TL_EXPAND3(...) TL_EXPAND2(TL_EXPAND2(TL_EXPAND2(__VA_ARGS__)))
#define TL_EXPAND2(...) TL_EXPAND1(TL_EXPAND1(TL_EXPAND1(__VA_ARGS__)))
#define TL_EXPAND1(...) __VA_ARGS__
#define TL_MEMBERS(T, member, ...) \
    {#member, offsetof(shared::T, member)}, __VA_OPT__(TL_MEMBERS_AGAIN TL_PARENTHESES (T, __VA_ARGS__))
#define TL_MEMBERS_AGAIN() TL_MEMBERS
/// A struct of shaders/shared with its members in order.
#define TL_LAYOUT(T, ...) {#T, {{TL_EXPAND(TL_MEMBERS(T, __VA_ARGS__))}, sizeof(shared::T)}}
// clang-format on

const std::map<std::string, StructLayout> kHostLayouts = {
    TL_LAYOUT(BvhNode, origin, exponents, children, lowX, lowY, lowZ, highX, highY, highZ, padding0, padding1),
    TL_LAYOUT(LeafTriangle, corner0, corner1, corner2, triangle),
    TL_LAYOUT(BptPush, frame, points, reservoirs, direct, caustic, indirect, vertices, vertexCounts, splats,
              maxVertices, maxDepth, rouletteDepth, powerShare),
    TL_LAYOUT(BptVertex, instance, primitive, uv, direction, flux, dVCM, dVC),
    TL_LAYOUT(Camera, position, lensRadius, filmCorner, focusDistance, filmU, nearClip, filmV, farClip, right, filmArea,
              up, pixelAngle, forward, padding),
    TL_LAYOUT(FrameConstants, scene, camera, previousCamera, width, height, frameIndex, sampleIndex, seed, flags,
              counters, bsdfTables, previousScene, currentLight, previousLight),
    TL_LAYOUT(Light, kind, instance, image, distribution, radiance, selection, position, area, axisU, radius, axisV,
              cosHalfAngle, normal, id),
    TL_LAYOUT(AliasEntry, threshold, alias),
    TL_LAYOUT(Distribution, marginal, conditional, density, width, height),
    TL_LAYOUT(Material, baseColor, metallic, specularColor, roughness, transmissionColor, transmission, emission, ior,
              specular, clearcoat, clearcoatRoughness, clearcoatIor, opacity, opacityThreshold, flags, baseColorMap,
              metallicMap, roughnessMap, emissionMap, opacityMap, normalMap, specularColorMap, clearcoatMap,
              clearcoatRoughnessMap, transmissionMap),
    TL_LAYOUT(TextureInput, scale, bias, du, dv, offset, image, channel, black),
    TL_LAYOUT(RaytracePush, frame, points, direct),
    TL_LAYOUT(PathtracePush, frame, points, direct, caustic, indirect, maxDepth, rouletteDepth),
    TL_LAYOUT(DenoiseSurface, position, normal, albedo, frames, chain),
    TL_LAYOUT(DenoiseReprojection, corner, weights, gain),
    TL_LAYOUT(DenoiseHistory, mean, squares, frames),
    TL_LAYOUT(DenoiseEmission, mean, squares, frames, light),
    TL_LAYOUT(DenoiseEmissionPush, frame, emission, emitters, previous, histories, flags, maxFrames),
    TL_LAYOUT(DenoiseSurfacesPush, frame, points, previous, surfaces, reprojection, flags, maxFrames),
    TL_LAYOUT(DenoiseAccumulatePush, frame, surfaces, reprojection, signals, previous, histories, differences, flags,
              maxFrames),
    TL_LAYOUT(DenoiseSumPush, frame, surfaces, histories, from, to, axis, spacing, changeSigma),
    TL_LAYOUT(DenoiseFilterPush, frame, surfaces, histories, from, to, signals, axis, spacing, sigma),
    TL_LAYOUT(PixelSums, sum, compensation, squares),
    TL_LAYOUT(CompositePush, frame, previous, sums, color, signals, signalCount, restart),
    TL_LAYOUT(AccumulatePush, frame, previous, sum, values, valueCount, channels, restart),
    TL_LAYOUT(PostPush, frame, sums, display, exposure, tonemap, frames),
    TL_LAYOUT(Mesh, nodes, leafTriangles, triangles, positions, normals, uvs, subsets, triangleCount, flags),
    TL_LAYOUT(Instance, localFromWorld, worldFromLocal, previousWorldFromLocal, shape, mesh, firstMaterial, firstLight,
              mask, flags),
    TL_LAYOUT(SceneTable, topNodes, topInstances, instances, meshes, materials, textureInputs, materialIndices, lights,
              lightAlias, lightOfTriangle, distributions, casters, instanceCount, lightCount, infiniteLightCount,
              casterCount, boundsCenter, boundsRadius, lightPower, padding),
    TL_LAYOUT(Caster, center, radius),
    TL_LAYOUT(GuideTarget, learned, flux, cumulative),
    TL_LAYOUT(CausticState, emitted, whole, arrivals, lit),
    TL_LAYOUT(Photon, position, normal, flux, direction, next),
    TL_LAYOUT(CausticPatch, key, irradiance, density),
    TL_LAYOUT(CausticsPush, frame, points, previousPoints, caustic, mean, previousMean, splats, guide, previousGuide,
              state, previousState, photons, heads, cache, cacheSums, cacheCounts, uniformShare, gatherRadius, share,
              historyFrames, cacheShare, photonLimit, headMask, knownGroups, knownCasters, flags),
    TL_LAYOUT(VisiblePoint, instance, primitive, uv, direction, footprint, throughput, dimension, chain),
    TL_LAYOUT(VisibleEmitter, light, motion),
    TL_LAYOUT(Probe, offset, flags, count, seen, spared, backShare, updates, watch, moves, settle, fast, last,
              variance),
    TL_LAYOUT(ProbeVolume, probes, irradiance, distances, origin, spacing, steps, probeCount, counts, scroll, selected,
              awake, serving, rays, period, round, seen, growth),
    TL_LAYOUT(ProbeRay, direction, distance, radiance, flags),
    TL_LAYOUT(ProbeTurn, probe, irradianceWeight, distanceWeight),
    TL_LAYOUT(ProbeBeginPush, frame, volume, probes, irradiance, distances, origin, spacing, steps, counts, scroll,
              rays, fewest, budget, waking),
    TL_LAYOUT(ProbeUpdatePush, frame, volume, volumes, turns, rays, causticCache, photons, causticState, rayCount,
              flags, tolerance, shift, firstProbe),
    TL_LAYOUT(ProbeLookup, radiance, instance, primitive),
    TL_LAYOUT(ProbeGatherPush, frame, points, volumes, causticCache, indirect, before, lookups, turn, moved),
    TL_LAYOUT(Reservoir, light, uv, weight, target, confidence, normal, depth),
    TL_LAYOUT(TemporalNeighbor, pixel, target),
    TL_LAYOUT(LightTile, lights, means, total, frames),
    TL_LAYOUT(ChosenLight, light, luminance),
    TL_LAYOUT(LearnPush, frame, chosen, tiles, restart),
    TL_LAYOUT(RestirPush, frame, points, previousPoints, previous, neighbors, merged, final, direct, tiles, chosen,
              learned, lightCandidates, learnedCandidates, bsdfCandidates, bsdfRoughness, maxHistory, spatialNeighbors,
              radius, history, alone),
    TL_LAYOUT(VisibilityPush, frame, points, emission, emitters, albedo, normal, depth, motion, maxBounces, flags),
};

const char* const kBlock = "LayoutOf";

std::vector<std::filesystem::path> sharedHeaders() {
    std::vector<std::filesystem::path> paths;
    for (const auto& entry : std::filesystem::directory_iterator(gpu::shaderRoot() / "shared"))
        if (entry.path().extension() == ".h") paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    return paths;
}

std::set<std::string> declaredStructs() {
    std::set<std::string> names;
    const std::regex declaration(R"(\bstruct\s+(\w+)\s*\{)");
    for (const auto& path : sharedHeaders()) {
        const std::string text = readTextFile(path);
        for (auto it = std::sregex_iterator(text.begin(), text.end(), declaration); it != std::sregex_iterator(); ++it)
            names.insert((*it)[1]);
    }
    return names;
}

/// A kernel whose push constants point to an array of each struct.
std::map<std::string, StructLayout> deviceLayouts(const std::set<std::string>& structs) {
    std::string text = "#version 460\n#extension GL_GOOGLE_include_directive : require\n";
    for (const auto& path : sharedHeaders()) text += "#include \"shared/" + path.filename().string() + "\"\n";
    std::string pointers;
    for (const std::string& name : structs) {
        text += "layout(buffer_reference, scalar, buffer_reference_align = 4) buffer " + (kBlock + name) + " { " +
                name + " v[]; };\n";
        pointers += kBlock + name + " to" + name + ";\n";
    }
    text += "layout(push_constant, scalar) uniform Push {\n" + pointers + "} push;\nvoid main() {}\n";
    return test::readLayouts(gpu::compileShader({.path = "layout_test", .text = text}).spirv, kBlock);
}

TEST(Layout, everyStructIsCovered) {
    const std::set<std::string> declared = declaredStructs();
    EXPECT_GE(declared.size(), 10u);
    for (const std::string& name : declared)
        EXPECT_TRUE(kHostLayouts.contains(name)) << name << ": add it to kHostLayouts in tests/layout/layout_test.cpp";
    for (const auto& [name, layout] : kHostLayouts) EXPECT_TRUE(declared.contains(name)) << name << ": is no more";
}

TEST(Layout, membersStandAtTheSameOffsets) {
    const std::set<std::string> structs = declaredStructs();
    const auto device = deviceLayouts(structs);
    for (const std::string& name : structs) {
        SCOPED_TRACE(name);
        ASSERT_TRUE(device.contains(name)) << "not found in SPIR-V";
        if (!kHostLayouts.contains(name)) continue; // the other test says so
        const StructLayout &onHost = kHostLayouts.at(name), &onDevice = device.at(name);
        EXPECT_EQ(onHost.stride, onDevice.stride) << "size in C++ against array stride in SPIR-V";
        ASSERT_EQ(onHost.members.size(), onDevice.members.size()) << "members named in the test, and in SPIR-V";
        for (size_t i = 0; i < onHost.members.size(); ++i) {
            EXPECT_EQ(onHost.members[i].name, onDevice.members[i].name) << "member " << i;
            EXPECT_EQ(onHost.members[i].offset, onDevice.members[i].offset) << onHost.members[i].name;
        }
    }
}

} // namespace
