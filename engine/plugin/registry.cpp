#include "plugin/registry.h"

#include "core/error.h"
#include "core/file.h"
#include "core/log.h"
#include "core/pfm.h"
#include "core/text.h"
#include "plugin/loader.h"
#include "plugin/manifest.h"
#include "scene/snapshot.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <optional>

namespace trilume {

namespace fs = std::filesystem;

namespace {

bool contains(const std::vector<std::string>& list, std::string_view word) {
    return std::find(list.begin(), list.end(), word) != list.end();
}

std::vector<std::string> distinct(std::vector<std::string> words) {
    std::sort(words.begin(), words.end());
    words.erase(std::unique(words.begin(), words.end()), words.end());
    return words;
}

/// Distinct words in order, as a list for a message.
std::string known(std::vector<std::string> words) {
    words = distinct(std::move(words));
    return words.empty() ? "none is known: is the installation complete?" : "known are " + commaList(words);
}

std::string suggest(std::string_view word, const std::vector<std::string>& words) {
    const std::string nearest = nearestWord(word, words);
    return nearest.empty() ? known(words) : fmt::format("did you mean {}? {}", nearest, known(words));
}

void checkReadable(const fs::path& path) {
    std::error_code error;
    if (!fs::exists(path, error)) throw inputError("no such file", path.string(), "check the path");
    if (fs::is_directory(path, error))
        throw inputError("not a file", path.string(), "this is a folder: name a file in it");
    if (fs::is_regular_file(path, error) && fs::file_size(path, error) == 0 && !error)
        throw inputError("the file is empty", path.string(), "write or copy it again");
}

/// What one plugin registers; taken over when it has registered all of it.
struct Offer {
    std::vector<NodeType> nodes;
    std::vector<ParamRow> params;
    std::vector<std::pair<std::string, SceneReader>> sceneReaders; // by extension
    std::vector<std::pair<std::string, ImageWriter>> imageWriters;
    std::vector<std::pair<std::string, std::function<ImageFilter()>>> imageFilters;
    std::optional<TextureReader> textureReader;
    std::string refusal;
};

} // namespace

struct Registry::Impl {
    enum class State { Known, Loading, Loaded, Declined };
    struct Plugin {
        PluginManifest manifest;
        State state = State::Known;
    };

    explicit Impl(Registry& self) : self(self) {}

    void scan(const fs::path& folder);
    void add(PluginManifest manifest);
    void addTechniques(std::vector<Technique> found, const fs::path& file);
    void load(Plugin& plugin);
    /// Loads what offers it by its plugin.json, in order, until `served` holds.
    /// Throws with the reason when every one that offers it was declined.
    void loadFor(const std::string& what, const std::function<bool(const PluginInfo&)>& offers,
                 const std::function<bool()>& served);
    void take(Offer offer);
    template<class T>
    void takeNamed(std::map<std::string, T, std::less<>>& table, std::string_view kind, std::string name, T value);
    /// Runs `change` on the offer of the plugin that is registering, else takes it over at once.
    template<class Change>
    void offer(Change change);

    template<class T>
    std::vector<std::string> names(const std::map<std::string, T, std::less<>>& table,
                                   std::vector<std::string> PluginInfo::*listed) const;

    Registry& self;
    mutable std::recursive_mutex mutex; // a plugin registers during a call of the application's
    std::vector<std::unique_ptr<Plugin>> plugins;
    std::deque<Technique> techniques; // views keep references
    std::map<std::string, NodeType, std::less<>> nodes;
    std::map<std::string, SceneReader, std::less<>> sceneReaders;
    std::map<std::string, ImageWriter, std::less<>> imageWriters;
    std::map<std::string, std::function<ImageFilter()>, std::less<>> imageFilters;
    TextureReader textureReader;
    ParamTable params;
    Offer* registering = nullptr;
};

// ---- finding ----

void Registry::Impl::scan(const fs::path& folder) {
    std::error_code error;
    std::vector<fs::path> directories;
    for (const auto& entry : fs::directory_iterator(folder, error))
        if (fs::exists(entry.path() / "plugin.json", error)) directories.push_back(entry.path());
    std::sort(directories.begin(), directories.end());
    for (const fs::path& directory : directories) {
        try {
            add(readManifest(directory));
        } catch (const Error& e) {
            log::warning("plugin skipped: {}", e.what());
        }
    }
}

void Registry::Impl::add(PluginManifest manifest) {
    for (const auto& other : plugins)
        if (other->manifest.info.name == manifest.info.name) {
            log::warning("plugin {} in {} ignored: the one in {} came first", manifest.info.name,
                         manifest.info.directory.string(), other->manifest.info.directory.string());
            return;
        }
    addTechniques(manifest.techniques, manifest.info.directory / "plugin.json");
    plugins.push_back(std::make_unique<Plugin>(Plugin{std::move(manifest)}));
}

void Registry::Impl::addTechniques(std::vector<Technique> found, const fs::path& file) {
    for (Technique& technique : found) {
        const auto same = [&](const Technique& t) { return t.name == technique.name; };
        if (std::any_of(techniques.begin(), techniques.end(), same))
            log::warning("technique {} in {} ignored: it is known already", technique.name, file.string());
        else
            techniques.push_back(std::move(technique));
    }
}

// ---- loading ----

void Registry::Impl::load(Plugin& plugin) {
    PluginInfo& info = plugin.manifest.info;
    Offer offer;
    Offer* const outer = std::exchange(registering, &offer);
    plugin.state = State::Loading;
    try {
        const PluginRegisterFunction registerPlugin = openPlugin(plugin.manifest.library, info.name);
        const int result = registerPlugin(reinterpret_cast<TlRegistry*>(&self));
        registering = outer;
        if (result != 0)
            throw inputError("the plugin refused to serve", info.directory.string(),
                             offer.refusal.empty() ? fmt::format("tlPluginRegister returned {}", result)
                                                   : offer.refusal);
        for (const std::string& name : info.nodes)
            if (std::none_of(offer.nodes.begin(), offer.nodes.end(), [&](const NodeType& n) { return n.name == name; }))
                throw inputError(fmt::format("plugin.json lists the node {}, which the plugin does not register", name),
                                 info.directory.string(), "correct one of the two");
        take(std::move(offer));
        plugin.state = State::Loaded;
        info.loaded = true;
        info.declined.clear();
    } catch (const std::exception& e) {
        registering = outer;
        plugin.state = State::Declined;
        info.declined = oneLine(e.what());
    }
}

void Registry::Impl::loadFor(const std::string& what, const std::function<bool(const PluginInfo&)>& offers,
                             const std::function<bool()>& served) {
    const Plugin* declined = nullptr;
    for (size_t i = 0; i < plugins.size() && !served(); ++i) {
        Plugin& plugin = *plugins[i];
        if (!offers(plugin.manifest.info)) continue;
        if (plugin.state == State::Known) load(plugin);
        if (plugin.state == State::Declined) declined = &plugin;
    }
    if (declined && !served())
        throw inputError(fmt::format("the plugin {} for {} was declined", declined->manifest.info.name, what),
                         declined->manifest.info.directory.string(), declined->manifest.info.declined);
}

template<class T>
void Registry::Impl::takeNamed(std::map<std::string, T, std::less<>>& table, std::string_view kind, std::string name,
                               T value) {
    if (const auto [it, isNew] = table.try_emplace(std::move(name), std::move(value)); !isNew)
        log::warning("{} {} is offered twice: the first one serves", kind, it->first);
}

void Registry::Impl::take(Offer offer) {
    ParamTable trial; // throws for a bad row before anything is taken
    for (const ParamRow& row : offer.params) trial.add(row);
    for (ParamRow& row : offer.params) {
        if (params.find(row.name))
            log::warning("parameter {} is offered twice: the first one serves", row.name);
        else
            params.add(std::move(row));
    }
    for (NodeType& node : offer.nodes) {
        std::string name = node.name;
        takeNamed(nodes, "node", std::move(name), std::move(node));
    }
    for (auto& [extension, reader] : offer.sceneReaders)
        takeNamed(sceneReaders, "scene reader", extension, std::move(reader));
    for (auto& [extension, writer] : offer.imageWriters)
        takeNamed(imageWriters, "image writer", extension, std::move(writer));
    for (auto& [name, create] : offer.imageFilters) takeNamed(imageFilters, "image filter", name, std::move(create));
    if (offer.textureReader) {
        if (textureReader)
            log::warning("a texture reader is offered twice: the first one serves");
        else
            textureReader = std::move(*offer.textureReader);
    }
}

template<class Change>
void Registry::Impl::offer(Change change) {
    const std::lock_guard lock(mutex);
    if (registering) {
        change(*registering);
        return;
    }
    Offer own;
    change(own);
    take(std::move(own));
}

template<class T>
std::vector<std::string> Registry::Impl::names(const std::map<std::string, T, std::less<>>& table,
                                               std::vector<std::string> PluginInfo::*listed) const {
    std::vector<std::string> words;
    words.reserve(table.size());
    for (const auto& [name, value] : table) words.push_back(name);
    for (const auto& plugin : plugins)
        for (const std::string& name : plugin->manifest.info.*listed) words.push_back(name);
    return words;
}

// ---- for plugins ----

Registry::Registry() : impl_(std::make_unique<Impl>(*this)) {
    addSceneReader({".tlscene"}, readSnapshot);
    const fs::path home = homeDirectory();
    const fs::path techniques = home / "share/trilume/techniques.json";
    try {
        impl_->addTechniques(readTechniques(techniques), techniques);
    } catch (const Error& e) {
        log::warning("no built-in techniques: {}", e.what());
    }
    impl_->scan(home / "lib/trilume/plugins");
    const char* variable = std::getenv("TRILUME_PLUGIN_PATH");
    std::string_view rest = variable ? variable : "";
    while (!rest.empty()) {
        const fs::path folder = rest.substr(0, rest.find(':'));
        rest.remove_prefix(std::min(rest.size(), folder.native().size() + 1));
        std::error_code error;
        if (fs::is_directory(folder, error))
            impl_->scan(folder);
        else if (!folder.empty())
            log::warning("no such folder in TRILUME_PLUGIN_PATH: {}", folder.string());
    }
}

Registry::~Registry() = default;

void Registry::addNode(NodeType type) {
    impl_->offer([&](Offer& offer) { offer.nodes.push_back(std::move(type)); });
}

void Registry::addParam(ParamRow row) {
    impl_->offer([&](Offer& offer) { offer.params.push_back(std::move(row)); });
}

void Registry::addSceneReader(std::vector<std::string> extensions, SceneReader reader) {
    impl_->offer([&](Offer& offer) {
        for (const std::string& e : extensions) offer.sceneReaders.emplace_back(normalizedExtension(e), reader);
    });
}

void Registry::addImageWriter(std::vector<std::string> extensions, ImageWriter writer) {
    impl_->offer([&](Offer& offer) {
        for (const std::string& e : extensions) offer.imageWriters.emplace_back(normalizedExtension(e), writer);
    });
}

void Registry::addImageFilter(std::string name, std::function<ImageFilter()> create) {
    impl_->offer([&](Offer& offer) { offer.imageFilters.emplace_back(std::move(name), std::move(create)); });
}

void Registry::addTextureReader(TextureReader reader) {
    impl_->offer([&](Offer& offer) { offer.textureReader = std::move(reader); });
}

void Registry::refuse(std::string reason) {
    impl_->offer([&](Offer& offer) { offer.refusal = std::move(reason); });
}

// ---- for applications ----

void Registry::loadPlugin(const fs::path& directory) {
    const std::lock_guard lock(impl_->mutex);
    PluginManifest manifest = readManifest(fs::absolute(directory).lexically_normal());
    auto& plugins = impl_->plugins;
    auto it = std::find_if(plugins.begin(), plugins.end(),
                           [&](const auto& p) { return p->manifest.info.name == manifest.info.name; });
    if (it != plugins.end()) {
        std::error_code error;
        if (!fs::equivalent((*it)->manifest.info.directory, directory, error))
            throw inputError(fmt::format("another plugin {} is known", manifest.info.name), directory.string(),
                             "the one in " + (*it)->manifest.info.directory.string() + " came first");
        if ((*it)->state == Impl::State::Declined) **it = Impl::Plugin{std::move(manifest)};
    } else {
        impl_->add(std::move(manifest));
        it = std::prev(plugins.end());
    }
    Impl::Plugin& plugin = **it;
    if (plugin.state == Impl::State::Known) impl_->load(plugin);
    if (plugin.state == Impl::State::Declined)
        throw inputError(fmt::format("the plugin {} was declined", plugin.manifest.info.name), directory.string(),
                         plugin.manifest.info.declined);
}

const NodeType& Registry::node(std::string_view name) {
    const std::lock_guard lock(impl_->mutex);
    auto& nodes = impl_->nodes;
    impl_->loadFor(
        fmt::format("node {}", name), [&](const PluginInfo& info) { return contains(info.nodes, name); },
        [&] { return nodes.find(name) != nodes.end(); });
    const auto it = nodes.find(name);
    if (it == nodes.end())
        throw inputError("unknown node", std::string(name), suggest(name, impl_->names(nodes, &PluginInfo::nodes)));
    return it->second;
}

const Technique& Registry::technique(std::string_view name) const {
    const std::lock_guard lock(impl_->mutex);
    std::vector<std::string> names;
    for (const Technique& technique : impl_->techniques) {
        if (technique.name == name) return technique;
        names.push_back(technique.name);
    }
    throw inputError("unknown technique", std::string(name), suggest(name, names));
}

const Technique& Registry::defaultTechnique() const {
    const std::lock_guard lock(impl_->mutex);
    const auto best = std::max_element(impl_->techniques.begin(), impl_->techniques.end(),
                                       [](const Technique& a, const Technique& b) { return a.rank < b.rank; });
    if (best == impl_->techniques.end())
        throw runError("no techniques", (homeDirectory() / "share/trilume/techniques.json").string(),
                       "install Trilume again");
    return *best;
}

std::vector<Technique> Registry::techniques() const {
    const std::lock_guard lock(impl_->mutex);
    return {impl_->techniques.begin(), impl_->techniques.end()};
}

void Registry::addTechnique(Technique technique) {
    const std::lock_guard lock(impl_->mutex);
    auto& techniques = impl_->techniques;
    const auto it = std::find_if(techniques.begin(), techniques.end(),
                                 [&](const Technique& t) { return t.name == technique.name; });
    if (it != techniques.end())
        *it = std::move(technique);
    else
        techniques.push_back(std::move(technique));
}

std::unique_ptr<Scene> Registry::readScene(const fs::path& path) {
    checkReadable(path);
    const std::string extension = lowerExtension(path.string());
    SceneReader reader;
    {
        const std::lock_guard lock(impl_->mutex);
        auto& readers = impl_->sceneReaders;
        impl_->loadFor(
            fmt::format("{} scenes", extension),
            [&](const PluginInfo& info) { return contains(info.sceneExtensions, extension); },
            [&] { return readers.contains(extension); });
        const auto it = readers.find(extension);
        if (it == readers.end())
            throw inputError("nothing reads scenes of this kind", path.string(),
                             known(impl_->names(readers, &PluginInfo::sceneExtensions)));
        reader = it->second;
    }
    std::unique_ptr<Scene> scene;
    try {
        scene = reader(path);
    } catch (const Error&) {
        throw;
    } catch (const std::exception& e) {
        throw inputError("cannot read the scene", path.string(), e.what());
    }
    if (!scene) throw runError("the scene reader returned nothing", path.string(), "this is a fault in its plugin");
    if (scene->path.empty()) scene->path = path.string();
    return scene;
}

void Registry::writeImage(const fs::path& path, const ImageData& image) {
    const size_t pixels = size_t{image.width} * image.height;
    if (image.channels == 0 || image.pixels.size() != pixels * image.channels)
        throw runError(fmt::format("an image of {} x {} x {} channels has {} values", image.width, image.height,
                                   image.channels, image.pixels.size()),
                       path.string(), "this is a fault in the program");
    const std::string extension = lowerExtension(path.string());
    if (extension == ".pfm") {
        if (image.channels == 3) return writePfm(path, image.width, image.height, image.pixels);
        std::vector<float> rgb(3 * pixels, 0.f);
        for (size_t i = 0; i < pixels; ++i)
            for (uint32_t c = 0; c < 3; ++c) {
                const uint32_t from = image.channels == 1 ? 0 : c;
                if (from < image.channels) rgb[3 * i + c] = image.pixels[i * image.channels + from];
            }
        return writePfm(path, image.width, image.height, rgb);
    }
    ImageWriter writer;
    {
        const std::lock_guard lock(impl_->mutex);
        auto& writers = impl_->imageWriters;
        impl_->loadFor(
            fmt::format("{} images", extension),
            [&](const PluginInfo& info) { return contains(info.imageExtensions, extension); },
            [&] { return writers.contains(extension); });
        const auto it = writers.find(extension);
        if (it == writers.end())
            throw inputError("nothing writes images of this kind", path.string(), known(imageExtensions()));
        writer = it->second;
    }
    writer(path, image);
}

bool Registry::canWriteImage(const fs::path& path) const {
    const std::lock_guard lock(impl_->mutex);
    const std::string extension = lowerExtension(path.string());
    return extension == ".pfm" || impl_->imageWriters.contains(extension) ||
           std::any_of(impl_->plugins.begin(), impl_->plugins.end(), [&](const auto& plugin) {
               return plugin->state == Impl::State::Known && contains(plugin->manifest.info.imageExtensions, extension);
           });
}

std::vector<std::string> Registry::sceneExtensions() const {
    const std::lock_guard lock(impl_->mutex);
    return distinct(impl_->names(impl_->sceneReaders, &PluginInfo::sceneExtensions));
}

std::vector<std::string> Registry::imageExtensions() const {
    const std::lock_guard lock(impl_->mutex);
    std::vector<std::string> words = impl_->names(impl_->imageWriters, &PluginInfo::imageExtensions);
    words.emplace_back(".pfm");
    return distinct(std::move(words));
}

ImageFilter Registry::imageFilter(std::string_view name) {
    const std::lock_guard lock(impl_->mutex);
    auto& filters = impl_->imageFilters;
    impl_->loadFor(
        fmt::format("image filter {}", name), [&](const PluginInfo& info) { return contains(info.imageFilters, name); },
        [&] { return filters.contains(name); });
    const auto it = filters.find(name);
    if (it == filters.end())
        throw inputError("unknown image filter", std::string(name),
                         suggest(name, impl_->names(filters, &PluginInfo::imageFilters)));
    return it->second();
}

Texture Registry::readTexture(const fs::path& path, ColorSpace colorSpace) {
    checkReadable(path);
    TextureReader reader;
    {
        const std::lock_guard lock(impl_->mutex);
        impl_->loadFor(
            "textures", [](const PluginInfo& info) { return info.textures; },
            [&] { return static_cast<bool>(impl_->textureReader); });
        reader = impl_->textureReader;
    }
    if (!reader) throw inputError("no plugin reads textures", path.string(), "build or install the plugin image_io");
    return reader(path, colorSpace);
}

const ParamTable& Registry::params() const { return impl_->params; }

std::vector<Registry::PluginInfo> Registry::plugins() const {
    const std::lock_guard lock(impl_->mutex);
    std::vector<PluginInfo> infos;
    for (const auto& plugin : impl_->plugins) infos.push_back(plugin->manifest.info);
    return infos;
}

} // namespace trilume
