#include "core/mapped_file.h"

#include "core/error.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace trilume {

MappedFile::MappedFile(const std::filesystem::path& path) {
    const auto fail = [&](const char* reason) { return inputError("cannot read file", path.string(), reason); };
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0) throw fail(std::strerror(errno));
    struct stat status {};
    const bool regular = ::fstat(file, &status) == 0 && S_ISREG(status.st_mode);
    size_ = regular ? static_cast<size_t>(status.st_size) : 0;
    if (size_ > 0) data_ = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, file, 0);
    const int reason = errno;
    ::close(file);
    if (!regular) throw inputError("not a file", path.string(), "name a file in place of this folder, pipe or device");
    if (data_ == MAP_FAILED) throw fail(std::strerror(reason));
    if (data_) ::madvise(data_, size_, MADV_WILLNEED);
}

MappedFile::~MappedFile() {
    if (data_) ::munmap(data_, size_);
}

} // namespace trilume
