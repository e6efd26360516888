#pragma once

#include "core/display.h"
#include "frame_spec.h"
#include "plugin/registry.h"
#include "render/renderer.h"

#include <string>
#include <vector>

namespace trilume::cli {

struct DisplayOptions {
    double exposure = 0; ///< EV
    ToneMap toneMap = ToneMap::Agx;
};

/// The files of a run: the picture and its AOVs, each with a name per frame.
class Outputs {
public:
    /// `aovs` are NAME=FILE. Throws inputError for one that isn't, for a file named twice, and for an AOV that the
    /// file's format can't hold.
    Outputs(std::string picture, const std::vector<std::string>& aovs, DisplayOptions display);

    /// Throws inputError for a format that nobody writes (listing those known) and for a folder that can't be written.
    void check(const Registry& registry) const;
    /// Throws inputError unless each frame has files of its own.
    void checkFor(const std::vector<double>& frames) const;

    std::vector<std::string> aovNames() const;
    const std::string& picturePattern() const { return files_.front().name.pattern(); }
    std::string picturePath(double frame) const { return files_.front().name.at(frame); }

    /// Whether every file of the frame exists and can be read to its end.
    bool complete(double frame, Registry& registry) const;

    /// Writes all of the frame's files, each whole or not at all.
    void write(double frame, Registry& registry, const ImageData& picture, View& view) const;

private:
    struct File {
        OutputName name;
        std::string aov; ///< empty: the picture
    };
    void writeOne(const File& file, double frame, Registry& registry, const ImageData& image) const;

    std::vector<File> files_;
    DisplayOptions display_;
};

/// Three channels, encoded for a display: light with exposure and tone map, albedo as it is, normals as 0.5 + 0.5 n.
ImageData displayImage(const ImageData& image, std::string_view aov, DisplayOptions display);

} // namespace trilume::cli
