#include "gpu/shader_compiler.h"

#include "core/error.h"
#include "core/file.h"
#include "core/log.h"
#include "gpu/cache_file.h"

#include <fmt/core.h>
#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>
#include <glslang/SPIRV/spirv.hpp>
#include <glslang/build_info.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <map>

namespace trilume::gpu {
namespace {

/// Names what the compiler and its settings make of a text: part of the cache key. Grow the last number with them.
constexpr uint64_t kCompilerVersion =
    ((GLSLANG_VERSION_MAJOR * 1000ull + GLSLANG_VERSION_MINOR) * 1000 + GLSLANG_VERSION_PATCH) * 1000 + 1;

/// The shader's own text and every file that it could include, by path below the shader root.
struct SourceTree {
    std::string path, text;
    std::map<std::string, std::string> includes;
};

std::string readBelowRoot(const std::string& path, const std::string& includer) {
    const auto root = shaderRoot();
    if (!std::filesystem::is_regular_file(root / path))
        throw inputError(fmt::format("shader '{}' not found", path), includer.empty() ? root.string() : includer,
                         "check the installation, or TRILUME_SHADERS and TRILUME_HOME");
    return readTextFile(root / path);
}

/// Follows #include "..." lines, also those that conditionals leave out: too many files in the key do no harm.
void collectIncludes(SourceTree& tree, const std::string& path, const std::string& text) {
    for (size_t line = 0; line < text.size();) {
        const size_t end = std::min(text.find('\n', line), text.size());
        const std::string_view content(text.data() + line, end - line);
        line = end + 1;
        const size_t start = content.find_first_not_of(" \t");
        if (start == std::string_view::npos || !content.substr(start).starts_with("#include")) continue;
        const size_t open = content.find('"', start);
        const size_t close = open == std::string_view::npos ? open : content.find('"', open + 1);
        if (close == std::string_view::npos) continue;
        const std::string name(content.substr(open + 1, close - open - 1));
        if (tree.includes.contains(name)) continue;
        const auto [entry, added] = tree.includes.emplace(name, readBelowRoot(name, path));
        collectIncludes(tree, name, entry->second);
    }
}

uint64_t hashText(std::string_view text, uint64_t seed) {
    const uint64_t size = text.size(); // separates ("ab","c") from ("a","bc")
    return hashBytes(std::as_bytes(std::span(text)), hashBytes(std::as_bytes(std::span(&size, 1)), seed));
}

uint64_t hashSource(const SourceTree& tree, const std::string& preamble) {
    uint64_t hash = hashText(preamble, kCompilerVersion);
    hash = hashText(tree.text, hash);
    for (const auto& [name, text] : tree.includes) hash = hashText(text, hashText(name, hash));
    return hash;
}

class Includer final : public glslang::TShader::Includer {
public:
    explicit Includer(const SourceTree& tree) : tree_(tree) {}
    IncludeResult* includeLocal(const char* name, const char*, size_t) override {
        const auto found = tree_.includes.find(name);
        if (found == tree_.includes.end()) return nullptr;
        return new IncludeResult(found->first, found->second.data(), found->second.size(), nullptr);
    }
    void releaseInclude(IncludeResult* result) override { delete result; }

private:
    const SourceTree& tree_;
};

/// "ERROR: lib/math.glsl:12: 'foo' : undeclared identifier" becomes an Error with its parts.
Error compileError(const std::string& path, std::string_view log) {
    const size_t start = log.find("ERROR: ");
    if (start == std::string_view::npos) return runError("the shader does not compile", path, "see the shader");
    std::string_view line = log.substr(start + 7);
    line = line.substr(0, line.find('\n'));
    size_t colon = line.find(':');
    if (colon != std::string_view::npos) colon = line.find(':', colon + 1);
    if (colon == std::string_view::npos) return runError("the shader does not compile", path, std::string(line));
    const std::string_view message = line.substr(std::min(line.find_first_not_of(" :", colon), line.size()));
    return runError("the shader does not compile", std::string(line.substr(0, colon)), std::string(message));
}

std::vector<uint32_t> compileToSpirv(const SourceTree& tree, const std::string& preamble) {
    static const bool initialized = glslang::InitializeProcess(); // tables, once; never torn down
    (void)initialized;

    glslang::TShader shader(EShLangCompute);
    const char* text = tree.text.data();
    const int length = static_cast<int>(tree.text.size());
    const char* name = tree.path.c_str();
    shader.setStringsWithLengthsAndNames(&text, &length, &name, 1);
    shader.setPreamble(preamble.c_str());
    shader.setEnvInput(glslang::EShSourceGlsl, EShLangCompute, glslang::EShClientVulkan, 460);
    shader.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_3);
    shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_6);

    constexpr auto kMessages = static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules);
    Includer includer(tree);
    if (!shader.parse(GetDefaultResources(), 460, false, kMessages, includer))
        throw compileError(tree.path, shader.getInfoLog());
    glslang::TProgram program;
    program.addShader(&shader);
    if (!program.link(kMessages)) throw compileError(tree.path, program.getInfoLog());

    glslang::SpvOptions options;
    // spirv-opt -O takes 0.7 s of a large pass once and 30 of the 115 ms that lavapipe then spends on each start of it.
    options.disableOptimizer = true;
    std::vector<uint32_t> spirv;
    glslang::GlslangToSpv(*program.getIntermediate(EShLangCompute), spirv, &options);
    return spirv;
}

/// Reads the work-group size, which SPIR-V 1.6 gives by the ids of constants, and what the host has to bind.
ShaderModule reflect(std::vector<uint32_t> spirv, const ShaderSource& source) {
    ShaderModule module;
    std::map<uint32_t, uint32_t> constants;       // by id
    std::map<uint32_t, uint32_t> specializations; // id to constant_id
    std::array<uint32_t, 3> sizeIds{};
    constexpr size_t kHeaderWords = 5;
    for (size_t i = kHeaderWords; i < spirv.size();) {
        const uint32_t words = spirv[i] >> spv::WordCountShift, op = spirv[i] & spv::OpCodeMask;
        if (words == 0 || i + words > spirv.size()) break;
        const uint32_t* operands = &spirv[i + 1];
        if (op == spv::OpExecutionModeId && words == 6 && operands[1] == spv::ExecutionModeLocalSizeId)
            std::copy_n(operands + 2, 3, sizeIds.begin());
        if (op == spv::OpDecorate && words == 4 && operands[1] == spv::DecorationSpecId)
            specializations[operands[0]] = operands[2];
        if ((op == spv::OpConstant || op == spv::OpSpecConstant) && words == 4) constants[operands[1]] = operands[2];
        module.usesTopLevel |= op == spv::OpTypeAccelerationStructureKHR;
        i += words;
    }
    for (size_t axis = 0; axis < 3; ++axis) {
        const auto constant = constants.find(sizeIds[axis]);
        if (constant == constants.end())
            throw runError("the shader has no local size", source.path, "give it a layout(local_size_x = ...) in");
        const auto special = specializations.find(constant->first);
        const bool given = special != specializations.end() && special->second < source.specialization.size();
        module.localSize[axis] = given ? source.specialization[special->second] : constant->second;
    }
    module.spirv = std::move(spirv);
    return module;
}

} // namespace

std::filesystem::path shaderRoot() {
    if (const char* root = std::getenv("TRILUME_SHADERS")) return root;
    return homeDirectory() / "share" / "trilume" / "shaders";
}

ShaderModule compileShader(const ShaderSource& source) {
    SourceTree tree{.path = source.path, .text = source.text.empty() ? readBelowRoot(source.path, "") : source.text};
    collectIncludes(tree, tree.path, tree.text);
    std::string preamble;
    for (const auto& [name, value] : source.defines) preamble += fmt::format("#define {} {}\n", name, value);

    const uint64_t key = hashSource(tree, preamble);
    const std::string entry = fmt::format("spirv/{:016x}.spv", key);
    if (const auto bytes = readCacheFile(entry, key); bytes && bytes->size() % 4 == 0) {
        std::vector<uint32_t> spirv(bytes->size() / 4);
        std::memcpy(spirv.data(), bytes->data(), bytes->size());
        return reflect(std::move(spirv), source);
    }
    std::vector<uint32_t> spirv = compileToSpirv(tree, preamble);
    writeCacheFile(entry, key, std::as_bytes(std::span(spirv)));
    return reflect(std::move(spirv), source);
}

} // namespace trilume::gpu
