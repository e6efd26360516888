#pragma once

#include "graph/graph.h"
#include "params/params.h"
#include "scene/scene.h"

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace trilume {

/// A technique is data: nodes top to bottom and parameter defaults. See techniques.json.
struct Technique {
    std::string name;
    std::string doc;
    std::vector<std::string> nodes;
    std::vector<std::pair<std::string, std::string>> defaults; ///< parameter rows
    bool reference = false;  ///< converges to the truth under averaging: no denoiser by default
    int rank = 0;            ///< the technique of highest rank is the default
};

/// Linear float pixels, row 0 at the top, `channels` interleaved.
struct ImageData {
    uint32_t width = 0, height = 0, channels = 3;
    std::vector<float> pixels;
};

struct NodeType {
    std::string name;
    std::string plugin;
    std::function<std::unique_ptr<graph::Node>()> create;
};

/// Fills a scene from a file. Throws inputError naming file and prim.
using SceneReader = std::function<std::unique_ptr<Scene>(const std::filesystem::path&)>;
/// Writes display-referred (png, jpg: values already encoded, 0..1) or linear images to the given path.
using ImageWriter = std::function<void(const std::filesystem::path&, const ImageData&)>;
/// Reads a texture; throws inputError naming the file.
using TextureReader = std::function<Texture(const std::filesystem::path&, ColorSpace)>;

/// What plugins register and applications use. Applications are built on this only.
class Registry {
public:
    /// Reads plugin.json files below `<home>/lib/trilume/plugins` and TRILUME_PLUGIN_PATH without loading any library:
    /// a plugin is loaded when a node, file extension or technique that it provides is first asked for.
    Registry();
    ~Registry();

    // ---- for plugins ----
    void addNode(NodeType type);
    void addParam(ParamRow row);
    void addSceneReader(std::vector<std::string> extensions, SceneReader reader);
    void addImageWriter(std::vector<std::string> extensions, ImageWriter writer);
    void addTextureReader(TextureReader reader);

    // ---- for applications ----
    /// Loads one plugin from a directory with plugin.json. Declines with a reason (inputError) on a version or ABI mismatch.
    void loadPlugin(const std::filesystem::path& directory);
    const NodeType& node(std::string_view name);
    const Technique& technique(std::string_view name) const; ///< throws inputError listing the known ones
    const Technique& defaultTechnique() const;
    std::span<const Technique> techniques() const;
    void addTechnique(Technique technique);
    /// Throws inputError for a missing file, a directory, an empty file, or an extension nobody reads.
    std::unique_ptr<Scene> readScene(const std::filesystem::path& path);
    /// By extension; .pfm is built in. Not atomic by itself.
    void writeImage(const std::filesystem::path& path, const ImageData& image);
    bool canWriteImage(const std::filesystem::path& path) const;
    Texture readTexture(const std::filesystem::path& path, ColorSpace colorSpace);
    /// Rows of the plugins loaded so far and, before that, of none: load a technique's nodes first.
    const ParamTable& params() const;

    struct PluginInfo {
        std::string name, version, description;
        std::filesystem::path directory;
        std::vector<std::string> nodes, sceneExtensions, imageExtensions;
        bool loaded = false;
        std::string declined; ///< why not, when it was
    };
    std::vector<PluginInfo> plugins() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace trilume
