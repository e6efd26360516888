#include "progress.h"

#include "core/log.h"

#include <fmt/core.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace trilume::cli {
namespace {

size_t terminalWidth() {
    winsize size{};
    return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

} // namespace

std::string durationText(double seconds) {
    const long whole = std::lround(std::clamp(seconds, 0.0, 1e9));
    if (whole >= 3600) return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
    if (whole >= 60) return fmt::format("{}:{:02}", whole / 60, whole % 60);
    return fmt::format("{} s", whole);
}

std::string progressLine(double fraction, double secondsLeft, size_t index, size_t count, size_t width) {
    const std::string frame = count > 1 ? fmt::format("frame {} of {}, ", index + 1, count) : "";
    const std::string text = fmt::format(" {:3.0f}% {}{} left", 100 * fraction, frame, durationText(secondsLeft));
    if (text.size() + 12 > width) return text.substr(0, width);
    const size_t cells = std::min<size_t>(width - text.size() - 2, 40);
    const auto filled = static_cast<size_t>(fraction * static_cast<double>(cells));
    return fmt::format("[{:=<{}}{:<{}}]{}", "", filled, "", cells - filled, text);
}

Progress::Progress(ProgressMode mode, size_t count)
    : shown_(mode == ProgressMode::On || (mode == ProgressMode::Auto && ::isatty(STDERR_FILENO) != 0)), count_(count) {
    if (!shown_) return;
    log::setSink([this](log::Level level, std::string_view message) {
        erase();
        fmt::print(stderr, "trilume: {}: {}\n", log::levelName(level), message);
    });
}

Progress::~Progress() {
    if (!shown_) return;
    erase();
    log::setSink({});
}

void Progress::erase() const { fmt::print(stderr, "\r\x1b[K"); }

void Progress::update(size_t index, double done) {
    const double ms = sinceStart_.ms();
    if (!shown_ || ms - drawnAt_ < 100) return;
    drawnAt_ = ms;
    const double fraction = (static_cast<double>(index) + std::clamp(done, 0.0, 1.0)) / static_cast<double>(count_);
    const double secondsLeft = fraction > 0 ? 1e-3 * ms * (1 - fraction) / fraction : 0;
    fmt::print(stderr, "\r{}\x1b[K", progressLine(fraction, secondsLeft, index, count_, terminalWidth() - 1));
    std::fflush(stderr);
}

} // namespace trilume::cli
