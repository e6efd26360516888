#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trilume {

/// `text` with each run of line breaks as one space, and none at the ends: fit for one line of output.
std::string oneLine(std::string_view text);

/// "a, b, c".
std::string commaList(std::span<const std::string> words);

/// The candidate with the fewest edits (insert, delete, substitute, swap of neighbours) from `word`, ignoring case;
/// empty when none is within a third of the word's length.
std::string nearestWord(std::string_view word, std::span<const std::string> candidates);

/// Lower-case extension with its dot, as `.exr`; empty when there is none.
std::string lowerExtension(std::string_view path);

} // namespace trilume
