#include "core/error.h"

#include "core/text.h"

#include <utility>

namespace trilume {
namespace {

std::string join(const std::string& what, const std::string& where, const std::string& hint) {
    std::string line = what;
    for (const std::string* part : {&where, &hint})
        if (!part->empty()) line += ": " + *part;
    return line;
}

} // namespace

Error::Error(Fault fault, const std::string& what, const std::string& where, const std::string& hint)
    : Error(fault, Parts{oneLine(what), oneLine(where), oneLine(hint)}) {}

Error::Error(Fault fault, Parts parts)
    : std::runtime_error(join(parts.what, parts.where, parts.hint)), fault_(fault), problem_(std::move(parts.what)),
      where_(std::move(parts.where)), hint_(std::move(parts.hint)) {}

} // namespace trilume
