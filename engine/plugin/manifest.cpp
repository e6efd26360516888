#include "plugin/manifest.h"

#include "core/error.h"
#include "core/file.h"

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>

namespace trilume {

namespace {

using nlohmann::json;

/// One JSON object with the file that it came from, for messages.
class Fields {
public:
    Fields(const json& object, const std::filesystem::path& file) : object_(object), file_(file) {
        if (!object.is_object()) throw wrong("not an object", "write { ... }");
    }

    Error wrong(const std::string& what, const std::string& hint) const {
        return inputError(what, file_.string(), hint);
    }
    /// The value of `key`, or `fallback` where the key is missing.
    template<class T>
    T get(const char* key, T fallback) const {
        const auto it = object_.find(key);
        if (it == object_.end()) return fallback;
        try {
            return it->get<T>();
        } catch (const json::exception& e) {
            throw wrong(fmt::format("\"{}\" has the wrong type", key), e.what());
        }
    }
    std::string getName(const char* key) const {
        std::string text = get<std::string>(key, {});
        if (text.empty()) throw wrong(fmt::format("\"{}\" is missing or empty", key), "give it a word");
        return text;
    }

private:
    const json& object_;
    const std::filesystem::path& file_;
};

json parseFile(const std::filesystem::path& file) {
    try {
        return json::parse(readTextFile(file));
    } catch (const json::parse_error& e) {
        throw inputError("not valid JSON", file.string(), e.what());
    }
}

std::vector<std::string> extensions(const Fields& fields, const char* key) {
    auto list = fields.get<std::vector<std::string>>(key, {});
    std::transform(list.begin(), list.end(), list.begin(), normalizedExtension);
    return list;
}

std::vector<Technique> parseTechniques(const json& array, const std::filesystem::path& file) {
    if (!array.is_array()) throw inputError("techniques are not an array", file.string(), "write [ ... ]");
    std::vector<Technique> techniques;
    for (const json& object : array) {
        const Fields fields(object, file);
        Technique& technique = techniques.emplace_back();
        technique.name = fields.getName("name");
        technique.doc = fields.get<std::string>("doc", {});
        technique.nodes = fields.get<std::vector<std::string>>("nodes", {});
        technique.reference = fields.get("reference", false);
        technique.overlapping = fields.get("overlapping", false);
        technique.rank = fields.get("rank", 0);
        if (technique.nodes.empty())
            throw fields.wrong(fmt::format("technique {} has no nodes", technique.name), "list them in \"nodes\"");
        for (const auto& [param, value] : fields.get<std::map<std::string, json>>("defaults", {}))
            technique.defaults.emplace_back(param, value.is_string() ? value.get<std::string>() : value.dump());
    }
    return techniques;
}

} // namespace

std::string normalizedExtension(std::string_view extension) {
    std::string text = extension.starts_with('.') ? "" : ".";
    for (const char c : extension) text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

PluginManifest readManifest(const std::filesystem::path& directory) {
    const std::filesystem::path file = directory / "plugin.json";
    const json document = parseFile(file);
    const Fields fields(document, file);
    PluginManifest manifest; // filled member by member: g++ 12 destroys twice what an aggregate holds when one throws
    manifest.info.name = fields.getName("name");
    manifest.info.version = fields.get<std::string>("version", {});
    manifest.info.description = fields.get<std::string>("description", {});
    manifest.info.directory = directory;
    manifest.info.nodes = fields.get<std::vector<std::string>>("nodes", {});
    manifest.info.sceneExtensions = extensions(fields, "sceneReaders");
    manifest.info.imageExtensions = extensions(fields, "imageWriters");
    manifest.info.imageFilters = fields.get<std::vector<std::string>>("imageFilters", {});
    manifest.info.textures = fields.get("textureReader", false);
    manifest.library = directory / fields.getName("library");
    manifest.techniques = parseTechniques(fields.get("techniques", json::array()), file);
    return manifest;
}

std::vector<Technique> readTechniques(const std::filesystem::path& file) {
    return parseTechniques(parseFile(file), file);
}

} // namespace trilume
