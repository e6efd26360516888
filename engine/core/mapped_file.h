#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace trilume {

/// A file's bytes as the operating system maps them, read where they are touched. A file that another process shortens
/// meanwhile is beyond help, as for every mapping; files that are replaced by renaming stay as they were.
class MappedFile {
public:
    /// Throws inputError naming the path when it is missing, a directory or unreadable.
    explicit MappedFile(const std::filesystem::path& path);
    ~MappedFile();
    MappedFile(const MappedFile&) = delete;
    MappedFile& operator=(const MappedFile&) = delete;

    std::span<const std::byte> bytes() const { return {static_cast<const std::byte*>(data_), size_}; }

private:
    void* data_ = nullptr;
    size_t size_ = 0;
};

} // namespace trilume
