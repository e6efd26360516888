#include "outputs.h"

#include "core/error.h"
#include "core/file.h"
#include "core/pfm.h"
#include "core/text.h"

#include <algorithm>
#include <set>

namespace trilume::cli {
namespace fs = std::filesystem;
namespace {

bool isDisplay(const std::string& extension) {
    return extension == ".png" || extension == ".jpg" || extension == ".jpeg";
}

/// What is no light and has no natural range or sign needs a format that holds any number.
bool isData(std::string_view aov) { return aov == "depth" || aov == "motion" || aov == "variance"; }

void checkHolds(const std::string& path, const std::string& aov) {
    const std::string extension = lowerExtension(path);
    const bool lossy = isDisplay(extension) ? isData(aov) : extension == ".hdr" && (aov == "motion" || aov == "normal");
    if (lossy) throw inputError("this format can't hold this AOV", aov + "=" + path, "write .exr or .pfm");
}

/// Reads all of it, as the beginning of a file that was cut short looks sound.
bool isWhole(const std::string& path, Registry& registry) {
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored)) return false;
    if (lowerExtension(path) == ".pfm") return isWholePfm(path);
    try {
        (void)registry.readTexture(path, ColorSpace::Linear);
        return true;
    } catch (const Error&) {
        return false;
    }
}

std::string knownFormats(const Registry& registry) {
    std::vector<std::string> extensions{".pfm"};
    for (const Registry::PluginInfo& plugin : registry.plugins())
        extensions.insert(extensions.end(), plugin.imageExtensions.begin(), plugin.imageExtensions.end());
    std::sort(extensions.begin(), extensions.end());
    return commaList(extensions);
}

} // namespace

Outputs::Outputs(std::string picture, const std::vector<std::string>& aovs, DisplayOptions display)
    : display_(display) {
    files_.push_back({OutputName(std::move(picture)), ""});
    for (const std::string& text : aovs) {
        const size_t equals = text.find('=');
        if (equals == 0 || equals == std::string::npos || equals + 1 == text.size())
            throw inputError("bad AOV", "--aov " + text, "write NAME=FILE, as in --aov albedo=albedo.exr");
        files_.push_back({OutputName(text.substr(equals + 1)), text.substr(0, equals)});
        checkHolds(files_.back().name.pattern(), files_.back().aov);
    }
    std::set<fs::path> patterns;
    for (const File& file : files_)
        if (!patterns.insert(fs::path(file.name.pattern()).lexically_normal()).second)
            throw inputError("two outputs have the same name", file.name.pattern(), "give each a file of its own");
}

void Outputs::check(const Registry& registry) const {
    for (const File& file : files_) {
        const fs::path path = file.name.pattern();
        if (!registry.canWriteImage(path))
            throw inputError("unknown image format", path.string(), "known are " + knownFormats(registry));
        checkWritable(path);
    }
}

void Outputs::checkFor(const std::vector<double>& frames) const {
    for (const File& file : files_) file.name.checkFor(frames);
}

std::vector<std::string> Outputs::aovNames() const {
    std::vector<std::string> names;
    for (const File& file : files_)
        if (!file.aov.empty()) names.push_back(file.aov);
    return names;
}

bool Outputs::complete(double frame, Registry& registry) const {
    return std::all_of(files_.begin(), files_.end(),
                       [&](const File& file) { return isWhole(file.name.at(frame), registry); });
}

void Outputs::write(double frame, Registry& registry, const ImageData& picture, View& view) const {
    // The picture last: where it stands, its AOVs do.
    for (const File& file : files_)
        if (!file.aov.empty()) writeOne(file, frame, registry, view.aov(file.aov));
    writeOne(files_.front(), frame, registry, picture);
}

void Outputs::writeOne(const File& file, double frame, Registry& registry, const ImageData& image) const {
    const std::string path = file.name.at(frame);
    try {
        writeFileAtomically(path, [&](const fs::path& temporary) {
            const bool display = isDisplay(lowerExtension(path));
            registry.writeImage(temporary, display ? displayImage(image, file.aov, display_) : image);
        });
    } catch (const Error& error) {
        throw Error(error.fault(), error.problem(), path, error.hint()); // Not the temporary's name.
    }
}

ImageData displayImage(const ImageData& image, std::string_view aov, DisplayOptions display) {
    ImageData shown{image.width, image.height, 3, {}};
    shown.pixels.reserve(size_t{3} * image.width * image.height);
    for (size_t i = 0; i < image.pixels.size(); i += image.channels)
        for (uint32_t c = 0; c < 3; ++c) shown.pixels.push_back(image.pixels[i + std::min(c, image.channels - 1)]);
    if (aov == "normal")
        for (float& x : shown.pixels) x = 0.5f + 0.5f * x;
    else if (aov == "albedo")
        toDisplay(shown.pixels, 0, ToneMap::None);
    else
        toDisplay(shown.pixels, display.exposure, display.toneMap);
    return shown;
}

} // namespace trilume::cli
