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
    bool reference = false;   ///< converges to the truth under averaging: no denoiser by default
    bool overlapping = false; ///< nodes may own the same path classes: their light counts several times
    int rank = 0;             ///< the technique of highest rank is the default
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
/// Changes a finished picture in place. The guides are the mean albedo and normal of what its pixels show, 3 channels.
using ImageFilter = std::function<void(ImageData& picture, const ImageData& albedo, const ImageData& normal)>;
/// Reads a texture; throws inputError naming the file.
using TextureReader = std::function<Texture(const std::filesystem::path&, ColorSpace)>;

/// What plugins register and applications use. Applications are built on this only.
///
/// A plugin.json names what its plugin offers: `name`, `library` (a file beside it), and as wanted `version`,
/// `description`, `nodes`, `sceneReaders` and `imageWriters` (file extensions), `imageFilters`, `textureReader`
/// (true), `techniques` (as in techniques.json). Where two plugins offer the same, the first found serves, with a
/// warning.
///
/// Plugins stay loaded until the process ends: nodes, readers and scenes that they made hold code of theirs, and some
/// (an embedded Python) can't be unloaded at all.
///
/// Calls may come from several threads.
class Registry {
public:
    /// Reads the plugin.json files in the folders of `<home>/lib/trilume/plugins`, then of each part of
    /// TRILUME_PLUGIN_PATH (separated by colons), and `<home>/share/trilume/techniques.json`, without loading any
    /// library: a plugin is loaded when a node or file extension that it offers is first asked for. A file that can't
    /// be read is skipped with a warning that names it.
    Registry();
    ~Registry();
    Registry(const Registry&) = delete;
    Registry& operator=(const Registry&) = delete;

    // ---- for plugins ----
    void addNode(NodeType type);
    void addParam(ParamRow row);
    void addSceneReader(std::vector<std::string> extensions, SceneReader reader);
    void addImageWriter(std::vector<std::string> extensions, ImageWriter writer);
    /// `create` may throw inputError where what the filter needs is missing.
    void addImageFilter(std::string name, std::function<ImageFilter()> create);
    void addTextureReader(TextureReader reader);
    /// Why tlPluginRegister is about to return non-zero; said by TL_PLUGIN.
    void refuse(std::string reason);

    // ---- for applications ----
    /// Loads one plugin from a directory with plugin.json, again where it was declined before. Throws inputError when
    /// the file is corrupt, the plugin is declined (version, ABI, missing symbol, its own refusal), or another plugin
    /// of its name is known.
    void loadPlugin(const std::filesystem::path& directory);
    /// Loads the plugin that offers the node. Throws inputError for an unknown node, with the nearest known one, and
    /// for one that only a declined plugin offers, with the reason.
    const NodeType& node(std::string_view name);
    const Technique& technique(std::string_view name) const; ///< throws inputError listing the known ones
    const Technique& defaultTechnique() const;               ///< throws runError when there is no technique at all
    std::vector<Technique> techniques() const;
    /// Replaces one of the same name. References to techniques stay valid.
    void addTechnique(Technique technique);
    /// By extension, whatever its case; .tlscene is built in. Throws inputError for a missing file, a directory, an
    /// empty file, or an extension nobody reads.
    std::unique_ptr<Scene> readScene(const std::filesystem::path& path);
    /// By extension, whatever its case; .pfm is built in (1 channel as grey, alpha dropped). Not atomic by itself.
    /// Throws inputError for an extension nobody writes.
    void writeImage(const std::filesystem::path& path, const ImageData& image);
    bool canWriteImage(const std::filesystem::path& path) const;
    /// What is read and written, by the engine and by all plugins found: extensions as `.exr`, in order.
    std::vector<std::string> sceneExtensions() const;
    std::vector<std::string> imageExtensions() const;
    /// Throws inputError for an unknown name.
    ImageFilter imageFilter(std::string_view name);
    /// Throws inputError for a missing or empty file, or when no plugin reads textures.
    Texture readTexture(const std::filesystem::path& path, ColorSpace colorSpace);
    /// Rows of the plugins loaded so far: ask for a technique's nodes first.
    const ParamTable& params() const;

    struct PluginInfo {
        std::string name, version, description;
        std::filesystem::path directory;
        std::vector<std::string> nodes, sceneExtensions, imageExtensions, imageFilters; ///< extensions as `.exr`
        bool textures = false;
        bool loaded = false;
        std::string declined; ///< why not, when it was
    };
    std::vector<PluginInfo> plugins() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace trilume
