#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace trilume::test {

struct StructLayout {
    struct Member {
        std::string name;
        uint32_t offset = 0;
        bool operator==(const Member&) const = default;
    };
    std::vector<Member> members;
    uint32_t stride = 0; ///< bytes from one to the next in an array
};

/// Layouts, by struct name, of the structs T that a module declares in blocks `buffer <prefix>T { T v[]; }`.
inline std::map<std::string, StructLayout> readLayouts(std::span<const uint32_t> spirv, const std::string& prefix) {
    enum : uint32_t { OpName = 5, OpMemberName = 6, OpTypeRuntimeArray = 29, OpTypeStruct = 30 };
    enum : uint32_t { OpDecorate = 71, OpMemberDecorate = 72, ArrayStride = 6, Offset = 35 };
    std::map<uint32_t, std::string> names;                                // of types
    std::map<uint32_t, std::map<uint32_t, StructLayout::Member>> members; // of structs
    std::map<uint32_t, uint32_t> firstMember, element, stride;

    constexpr size_t kHeaderWords = 5;
    for (size_t at = kHeaderWords; at < spirv.size(); at += spirv[at] >> 16) {
        const uint32_t* words = &spirv[at];
        const auto text = [&](size_t word) { return std::string(reinterpret_cast<const char*>(words + word)); };
        switch (words[0] & 0xffffu) {
        case OpName:
            names[words[1]] = text(2);
            break;
        case OpMemberName:
            members[words[1]][words[2]].name = text(3);
            break;
        case OpMemberDecorate:
            if (words[3] == Offset) members[words[1]][words[2]].offset = words[4];
            break;
        case OpDecorate:
            if (words[2] == ArrayStride) stride[words[1]] = words[3];
            break;
        case OpTypeRuntimeArray:
            element[words[1]] = words[2];
            break;
        case OpTypeStruct:
            firstMember[words[1]] = words[0] >> 16 > 2 ? words[2] : 0;
            break;
        default:
            break;
        }
    }

    std::map<std::string, StructLayout> layouts;
    for (const auto& [block, array] : firstMember) {
        if (!names[block].starts_with(prefix)) continue;
        StructLayout& layout = layouts[names[block].substr(prefix.size())];
        layout.stride = stride[array];
        for (const auto& [index, member] : members[element[array]]) layout.members.push_back(member);
    }
    return layouts;
}

} // namespace trilume::test
