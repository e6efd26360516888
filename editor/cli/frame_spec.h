#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace trilume::cli {

/// Time codes in the order that usdrecord's frame spec gives them: comma lists of `FRAME`, `FIRST:LAST` (down when LAST
/// is smaller) and `FIRST:LASTxSTRIDE`; a repeated time code counts once. Throws inputError naming the part that is
/// bad.
std::vector<double> parseFrameSpec(std::string_view spec);

/// A path in which the last run of `#` in the file's name stands for the frame number, zero-padded to the run's length,
/// and `##.##` for one with decimals, as in usdrecord.
class OutputName {
public:
    explicit OutputName(std::string pattern) : pattern_(std::move(pattern)) {}

    /// Throws inputError unless each of the frames has a path of its own: several frames need a placeholder, and
    /// time codes between whole frames need decimals in it.
    void checkFor(const std::vector<double>& frames) const;
    std::string at(double frame) const;
    const std::string& pattern() const { return pattern_; }

private:
    std::string pattern_;
};

/// "3" or "3.25": a time code as messages name it.
std::string frameText(double frame);

} // namespace trilume::cli
