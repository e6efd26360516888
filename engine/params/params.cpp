#include "params/params.h"

#include "core/error.h"
#include "core/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

namespace trilume {
namespace {

template<class Number>
std::optional<Number> parseNumber(std::string_view text) {
    if (text.starts_with('+')) text.remove_prefix(1);
    Number number{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

std::optional<bool> parseBool(std::string_view text) {
    if (text == "1" || text == "true" || text == "on" || text == "yes") return true;
    if (text == "0" || text == "false" || text == "off" || text == "no") return false;
    return std::nullopt;
}

/// Whether a value of the row's type lies in its range or is one of its choices. NaN lies in no range.
bool allowed(const ParamRow& row, const ParamValue& value) {
    if (const auto* integer = std::get_if<int64_t>(&value))
        return static_cast<double>(*integer) >= row.minimum && static_cast<double>(*integer) <= row.maximum;
    if (const auto* real = std::get_if<double>(&value)) return *real >= row.minimum && *real <= row.maximum;
    if (const auto* word = std::get_if<std::string>(&value))
        return row.choices.empty() || std::find(row.choices.begin(), row.choices.end(), *word) != row.choices.end();
    return true;
}

std::string describeAllowed(const ParamRow& row) {
    const std::string unit = row.unit.empty() ? "" : " " + row.unit;
    if (std::holds_alternative<bool>(row.defaultValue)) return "give 0 or 1";
    if (std::holds_alternative<int64_t>(row.defaultValue))
        return fmt::format("give a whole number from {} to {}{}", row.minimum, row.maximum, unit);
    if (std::holds_alternative<double>(row.defaultValue))
        return fmt::format("give a number from {} to {}{}", row.minimum, row.maximum, unit);
    return "give one of: " + commaList(row.choices);
}

std::optional<ParamValue> parse(const ParamRow& row, std::string_view text) {
    std::optional<ParamValue> value;
    if (std::holds_alternative<bool>(row.defaultValue)) {
        if (const auto flag = parseBool(text)) value = *flag;
    } else if (std::holds_alternative<int64_t>(row.defaultValue)) {
        if (const auto number = parseNumber<int64_t>(text)) value = *number;
    } else if (std::holds_alternative<double>(row.defaultValue)) {
        if (const auto number = parseNumber<double>(text)) value = *number;
    } else {
        value = std::string(text);
    }
    if (value && !allowed(row, *value)) value.reset();
    return value;
}

Error unknownParam(const ParamTable& table, std::string_view name) {
    std::vector<std::string> names;
    for (const ParamRow& row : table.rows()) names.push_back(row.name);
    const std::string nearest = nearestWord(name, names);
    return inputError("unknown parameter", std::string(name),
                      nearest.empty() ? "`trilume info` lists the parameters" : "did you mean " + nearest + "?");
}

double number(const ParamValue& value) {
    const auto* integer = std::get_if<int64_t>(&value);
    return integer ? static_cast<double>(*integer) : std::get<double>(value);
}

template<class T>
const T& typed(std::string_view name, const ParamValue& value) {
    if (const T* typed = std::get_if<T>(&value)) return *typed;
    throw runError("parameter read as another type than its row's", std::string(name),
                   "correct the node that reads it");
}

} // namespace

void ParamTable::add(ParamRow row) {
    if (find(row.name)) throw runError("parameter registered twice", row.name, "rename one of the two rows");
    if (!allowed(row, row.defaultValue))
        throw runError("default out of its own range", row.name, describeAllowed(row) + " in its row");
    if (row.least != 0 && (row.resetsHistory || row.least < std::max(row.minimum, 1e-9)))
        throw runError("effort may not lower this parameter so far", row.name,
                       "keep least above 0 and the minimum, and in rows that don't reset history");
    index_.emplace(row.name, rows_.size());
    rows_.push_back(std::move(row));
}

const ParamRow* ParamTable::find(std::string_view name) const {
    const auto found = index_.find(name);
    return found == index_.end() ? nullptr : &rows_[found->second];
}

void ParamSet::set(std::string_view name, std::string_view text) { store(values_, name, text); }

void ParamSet::setDefault(std::string_view name, std::string_view text) { store(defaults_, name, text); }

void ParamSet::clearDefaults() {
    while (!defaults_.empty()) {
        const ParamRow& row = *table_->find(defaults_.begin()->first);
        const ParamValue before = value(row.name);
        defaults_.erase(defaults_.begin());
        govern(row);
        noteChange(row, before);
    }
}

void ParamSet::store(Values& values, std::string_view name, std::string_view text) {
    const ParamRow* row = table_->find(name);
    if (!row) throw unknownParam(*table_, name);
    std::optional<ParamValue> parsed = parse(*row, text);
    if (!parsed) throw inputError("bad value for parameter", fmt::format("{}={}", name, text), describeAllowed(*row));
    const ParamValue before = value(name);
    values.insert_or_assign(std::string(name), std::move(*parsed));
    govern(*row);
    noteChange(*row, before);
}

void ParamSet::setEffort(double effort) {
    effort_ = std::clamp(effort, 0.0, 1.0);
    for (const ParamRow& row : table_->rows()) {
        if (row.least == 0) continue;
        const ParamValue before = value(row.name);
        govern(row);
        noteChange(row, before);
    }
}

double ParamSet::effortRange() const {
    double range = 0;
    for (const ParamRow& row : table_->rows())
        if (row.least != 0) range = std::max(range, std::log(number(valueSet(row.name)) / row.least));
    return range;
}

void ParamSet::govern(const ParamRow& row) {
    if (row.least == 0) return;
    governed_.erase(row.name);
    const ParamValue& set = valueSet(row.name);
    const double full = number(set);
    if (effort_ == 1 || full <= row.least) return;
    const double scaled = row.least * std::pow(full / row.least, effort_);
    governed_[row.name] =
        std::holds_alternative<int64_t>(set) ? ParamValue(static_cast<int64_t>(std::llround(scaled))) : scaled;
}

void ParamSet::noteChange(const ParamRow& row, const ParamValue& before) {
    if (value(row.name) == before) return;
    ++revision_;
    if (row.cost == ParamCost::Structural) ++structuralRevision_;
    if (row.resetsHistory) ++historyRevision_;
}

const ParamValue& ParamSet::value(std::string_view name) const {
    const auto governed = governed_.find(name);
    return governed != governed_.end() ? governed->second : valueSet(name);
}

const ParamValue& ParamSet::valueSet(std::string_view name) const {
    for (const Values* values : {&values_, &defaults_})
        if (const auto found = values->find(name); found != values->end()) return found->second;
    const ParamRow* row = table_->find(name);
    if (!row) throw unknownParam(*table_, name);
    return row->defaultValue;
}

bool ParamSet::getBool(std::string_view name) const { return typed<bool>(name, value(name)); }

int64_t ParamSet::getInt(std::string_view name) const { return typed<int64_t>(name, value(name)); }

double ParamSet::getFloat(std::string_view name) const { return typed<double>(name, value(name)); }

const std::string& ParamSet::getChoice(std::string_view name) const { return typed<std::string>(name, value(name)); }

std::string ParamSet::getText(std::string_view name) const {
    return std::visit([](const auto& v) { return fmt::format("{}", v); }, valueSet(name));
}

} // namespace trilume
