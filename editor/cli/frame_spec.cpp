#include "frame_spec.h"

#include "core/error.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

namespace trilume::cli {
namespace {

constexpr size_t kMostFrames = 1'000'000;

Error badSpec(std::string_view part, std::string why) {
    return inputError("bad frames", "--frames " + std::string(part),
                      std::move(why) + "; write for example 1, 1:24, 1:24x2 or 1,5,10:20");
}

double parseNumber(std::string_view text, std::string_view part) {
    double number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number))
        throw badSpec(part, "\"" + std::string(text) + "\" is not a frame number");
    return number;
}

void appendPart(std::string_view part, std::vector<double>& frames) {
    const size_t colon = part.find(':');
    if (colon == std::string_view::npos) {
        frames.push_back(parseNumber(part, part));
        return;
    }
    const size_t cross = part.find('x', colon);
    const double first = parseNumber(part.substr(0, colon), part);
    const double last =
        parseNumber(part.substr(colon + 1, cross == std::string_view::npos ? cross : cross - colon - 1), part);
    const double stride =
        cross == std::string_view::npos ? (last < first ? -1 : 1) : parseNumber(part.substr(cross + 1), part);
    if (stride == 0 || (last - first) * stride < 0) throw badSpec(part, "the stride never leads to the last frame");
    // The last frame counts although a stride such as 0.1 is not exact in binary.
    const double steps = std::floor((last - first) / stride + 1e-6);
    if (steps >= kMostFrames) throw badSpec(part, fmt::format("more than {} frames", kMostFrames));
    for (double step = 0; step <= steps; ++step) frames.push_back(first + step * stride);
}

/// Where the placeholder stands: `digits` of it before the point, `decimals` behind.
struct Placeholder {
    size_t begin = std::string::npos, length = 0, digits = 0, decimals = 0;
};

/// The last one of the file's name; folders stand as they are written.
Placeholder findPlaceholder(std::string_view pattern) {
    const size_t last = pattern.rfind('#'), slash = pattern.rfind('/');
    if (last == std::string::npos || (slash != std::string::npos && last < slash)) return {};
    const auto beginOfRun = [&](size_t end) { return pattern.find_last_not_of('#', end - 1) + 1; };
    const size_t end = last + 1, run = beginOfRun(end);
    if (run < 2 || pattern[run - 1] != '.' || pattern[run - 2] != '#') return {run, end - run, end - run, 0};
    const size_t begin = beginOfRun(run - 1);
    return {begin, end - begin, run - 1 - begin, end - run};
}

} // namespace

std::vector<double> parseFrameSpec(std::string_view spec) {
    std::vector<double> frames;
    for (size_t begin = 0; begin <= spec.size();) {
        const size_t end = std::min(spec.find(',', begin), spec.size());
        appendPart(spec.substr(begin, end - begin), frames);
        begin = end + 1;
    }
    std::set<double> seen;
    std::erase_if(frames, [&](double frame) { return !seen.insert(frame).second; });
    return frames;
}

void OutputName::checkFor(const std::vector<double>& frames) const {
    const Placeholder p = findPlaceholder(pattern_);
    if (frames.size() > 1 && p.begin == std::string::npos)
        throw inputError("several frames would overwrite each other", pattern_,
                         "put #### where the frame number belongs, as in out.####.exr");
    std::set<std::string> names;
    for (const double frame : frames) {
        if (p.digits > 0 && p.decimals == 0 && frame != std::round(frame))
            throw inputError("the name has no place for the decimals of frame " + frameText(frame), pattern_,
                             "write ####.### for time codes between whole frames");
        if (!names.insert(at(frame)).second)
            throw inputError("two frames have the same name", at(frame),
                             "write ####.### for time codes between whole frames");
    }
}

std::string OutputName::at(double frame) const {
    const Placeholder p = findPlaceholder(pattern_);
    if (p.begin == std::string::npos) return pattern_;
    const size_t width = p.digits + (p.decimals > 0 ? 1 + p.decimals : 0);
    return pattern_.substr(0, p.begin) + fmt::format("{:0{}.{}f}", frame, width, p.decimals) +
           pattern_.substr(p.begin + p.length);
}

std::string frameText(double frame) { return fmt::format("{:g}", frame); }

} // namespace trilume::cli
