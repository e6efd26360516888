#include "core/file.h"

#include "core/error.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace trilume {
namespace fs = std::filesystem;
namespace {

template<class Container>
Container readWhole(const fs::path& path) {
    std::error_code ignored;
    if (fs::is_directory(path, ignored))
        throw inputError("not a file", path.string(), "this is a folder: name a file in it");
    std::ifstream stream(path, std::ios::binary | std::ios::ate);
    if (!stream) {
        const char* reason = std::strerror(errno);
        throw inputError("cannot read file", path.string(),
                         fs::exists(path, ignored) ? std::string(reason) : "no such file: check the path");
    }
    Container bytes(static_cast<size_t>(stream.tellg()), {});
    stream.seekg(0);
    stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!stream) throw inputError("cannot read file", path.string(), "reading it failed half way: check the disk");
    return bytes;
}

/// Devices and pipes, which are written to as they stand: renaming a file over one would replace it.
bool isSpecial(const fs::path& path) {
    std::error_code ignored;
    const fs::file_status status = fs::status(path, ignored);
    return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

/// What a link leads to, so that the link stays; else the path as it is.
fs::path throughLinks(const fs::path& path) {
    std::error_code error;
    const fs::path target = fs::is_symlink(path, error) ? fs::canonical(path, error) : path;
    return error ? path : target;
}

fs::path folderOf(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

/// A file beside its target that is removed unless renamed over it.
class TemporaryFile {
public:
    explicit TemporaryFile(const fs::path& target) : target_(target), path_(nameBeside(target)) {
        std::error_code ignored;
        if (fs::is_directory(target, ignored))
            throw inputError("cannot write file", target.string(), "this is a folder: name a file in it");
        const int file = ::open(path_.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
        if (file < 0) {
            const char* reason = std::strerror(errno);
            if (!fs::is_directory(folderOf(target), ignored))
                throw inputError("cannot write file", target.string(), "its folder does not exist: create it first");
            throw inputError("cannot write file", target.string(),
                             std::string(reason) + ": choose a folder that you can write to");
        }
        ::close(file);
    }
    ~TemporaryFile() {
        std::error_code ignored;
        if (!path_.empty()) fs::remove(path_, ignored);
    }
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;

    const fs::path& path() const { return path_; }
    void replaceTarget() {
        std::error_code error;
        fs::rename(path_, target_, error);
        if (error) throw runError("cannot replace file", target_.string(), error.message());
        path_.clear();
    }

private:
    static fs::path nameBeside(const fs::path& target) {
        static std::atomic<unsigned> serial = 0;
        return folderOf(target) / fmt::format(".{}.{}-{}.tmp{}", target.stem().string(), ::getpid(), serial++,
                                              target.extension().string());
    }

    fs::path target_, path_;
};

/// The file that this code was loaded from: the shared library, or the program that links the engine statically.
fs::path ownBinary() {
    Dl_info info{};
    if (::dladdr(reinterpret_cast<const void*>(&ownBinary), &info) != 0 && info.dli_fname) {
        std::error_code error;
        fs::path path = fs::canonical(info.dli_fname, error);
        if (!error) return path;
    }
    std::error_code ignored;
    return fs::read_symlink("/proc/self/exe", ignored);
}

fs::path findHome() {
    const fs::path binary = ownBinary();
    std::error_code ignored;
    for (fs::path folder = binary.parent_path(); folder.has_relative_path(); folder = folder.parent_path())
        if (fs::is_directory(folder / "share/trilume/shaders", ignored)) return folder;
    throw runError("cannot find Trilume's shaders", binary.string(),
                   "no share/trilume/shaders above it: set TRILUME_HOME to the installation or build folder");
}

} // namespace

std::vector<std::byte> readFile(const fs::path& path) { return readWhole<std::vector<std::byte>>(path); }
std::string readTextFile(const fs::path& path) { return readWhole<std::string>(path); }

void writeFileAtomically(const fs::path& path, const std::function<void(const fs::path&)>& write) {
    if (isSpecial(path)) return write(path);
    TemporaryFile file(throughLinks(path));
    write(file.path());
    file.replaceTarget();
}

void writeFileAtomically(const fs::path& path, std::span<const std::byte> bytes) {
    writeFileAtomically(path, [&](const fs::path& temporary) {
        std::ofstream stream(temporary, std::ios::binary);
        stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        stream.close();
        if (!stream) throw runError("cannot write file", path.string(), "writing failed: is the disk full?");
    });
}

void checkWritable(const fs::path& path) {
    if (!isSpecial(path))
        TemporaryFile{throughLinks(path)};
    else if (::access(path.c_str(), W_OK) != 0)
        throw inputError("cannot write file", path.string(), std::strerror(errno));
}

fs::path homeDirectory() {
    if (const char* home = std::getenv("TRILUME_HOME"); home && *home) return home;
    static const fs::path found = findHome();
    return found;
}

fs::path cacheDirectory() {
    fs::path folder;
    if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache == '/')
        folder = fs::path(cache) / "trilume";
    else if (const char* home = std::getenv("HOME"); home && *home)
        folder = fs::path(home) / ".cache/trilume";
    if (folder.empty()) return {};
    std::error_code error;
    fs::create_directories(folder, error);
    return error || ::access(folder.c_str(), W_OK) != 0 ? fs::path() : folder;
}

uint64_t hashBytes(std::span<const std::byte> bytes, uint64_t seed) {
    uint64_t hash = seed;
    for (const std::byte b : bytes) hash = (hash ^ static_cast<uint64_t>(b)) * 0x100000001b3ull;
    return hash;
}

} // namespace trilume
