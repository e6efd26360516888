#include "core/error.h"
#include "core/file.h"
#include "core/log.h"
#include "core/pfm.h"
#include "core/text.h"
#include "errors.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <iterator>

namespace trilume {
namespace {
namespace fs = std::filesystem;
using test::errorOf;

class TemporaryFolder {
public:
    TemporaryFolder() {
        std::string name = (fs::temp_directory_path() / "trilume-core-XXXXXX").string();
        path = ::mkdtemp(name.data());
    }
    ~TemporaryFolder() { fs::remove_all(path); }
    size_t fileCount() const { return static_cast<size_t>(std::distance(fs::directory_iterator(path), {})); }

    fs::path path;
};

TEST(Error, IsOneLineOfWhatWhereHint) {
    const Error error = inputError("bad\nvalue", "stage.usda", "\ngive a number\n");
    EXPECT_STREQ(error.what(), "bad value: stage.usda: give a number");
    EXPECT_EQ(error.problem(), "bad value");
    EXPECT_EQ(error.where(), "stage.usda");
    EXPECT_EQ(error.hint(), "give a number");
    EXPECT_EQ(error.fault(), Fault::Input);
    EXPECT_STREQ(runError("lost", "", "retry").what(), "lost: retry");
    EXPECT_EQ(static_cast<int>(runError("", "", "").fault()), 1);
    EXPECT_EQ(static_cast<int>(Fault::Input), 2);
}

TEST(Text, NearestWordForgivesTyposAndNoMore) {
    const std::vector<std::string> words{"pathtrace.nee", "pathtrace.maxDepth", "light.selection"};
    EXPECT_EQ(nearestWord("pathtrace.ne", words), "pathtrace.nee");
    EXPECT_EQ(nearestWord("PathTrace.NEE", words), "pathtrace.nee");
    EXPECT_EQ(nearestWord("light.seleciton", words), "light.selection");
    EXPECT_EQ(nearestWord("exposure", words), "");
    EXPECT_EQ(nearestWord("x", {}), "");
}

TEST(Text, LowerExtension) {
    EXPECT_EQ(lowerExtension("a/b.C/out.####.EXR"), ".exr");
    EXPECT_EQ(lowerExtension("a.b/out"), "");
}

TEST(Log, SinkLevelAndOnce) {
    std::vector<std::string> lines;
    log::setSink([&](log::Level level, std::string_view line) {
        lines.push_back((level == log::Level::Warning ? "W " : "? ") + std::string(line));
    });
    log::setLevel(log::Level::Warning);
    log::info("dropped {}", 1);
    log::warning("kept {}\nline", 2);
    log::writeOnce(log::Level::Warning, "core_test.key", "once");
    log::writeOnce(log::Level::Warning, "core_test.key", "once");
    log::setSink({});
    EXPECT_EQ(lines, (std::vector<std::string>{"W kept 2 line", "W once"}));
}

TEST(Log, DefaultSinkWritesTheCommandsFormat) {
    testing::internal::CaptureStderr();
    log::warning("one {}", "thing");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "trilume: warning: one thing\n");
}

TEST(File, ReadsWhatWasWritten) {
    const TemporaryFolder folder;
    const std::string text("a\0b\n", 4);
    writeFileAtomically(folder.path / "x.bin", std::as_bytes(std::span(text)));
    EXPECT_EQ(readTextFile(folder.path / "x.bin"), text);
    EXPECT_EQ(readFile(folder.path / "x.bin").size(), 4u);
    EXPECT_EQ(folder.fileCount(), 1u);
}

TEST(File, ReadingNamesThePath) {
    const TemporaryFolder folder;
    const Error missing = errorOf([&] { readFile(folder.path / "none.usda"); });
    EXPECT_EQ(missing.fault(), Fault::Input);
    EXPECT_EQ(missing.where(), (folder.path / "none.usda").string());
    EXPECT_EQ(errorOf([&] { readTextFile(folder.path); }).problem(), "not a file");
}

TEST(File, TemporaryStandsBesideWithTheSameExtension) {
    const TemporaryFolder folder;
    const fs::path target = folder.path / "out.0001.exr";
    writeFileAtomically(target, [&](const fs::path& temporary) {
        EXPECT_EQ(temporary.parent_path(), folder.path);
        EXPECT_EQ(temporary.extension(), ".exr");
        EXPECT_NE(temporary, target);
        EXPECT_FALSE(fs::exists(target));
        std::ofstream(temporary) << "pixels";
    });
    EXPECT_EQ(readTextFile(target), "pixels");
}

TEST(File, ThrowingWriterLeavesEverythingAsItWas) {
    const TemporaryFolder folder;
    const fs::path target = folder.path / "out.png";
    std::ofstream(target) << "old";
    const auto failing = [](const fs::path& temporary) {
        std::ofstream(temporary) << "half";
        throw runError("encoder failed", "", "");
    };
    EXPECT_THROW(writeFileAtomically(target, failing), Error);
    EXPECT_EQ(readTextFile(target), "old");
    EXPECT_EQ(folder.fileCount(), 1u);
}

TEST(File, LinksStayAndPipesAreWrittenTo) {
    const TemporaryFolder folder;
    std::ofstream(folder.path / "real.bin") << "old";
    fs::create_symlink(folder.path / "real.bin", folder.path / "link.bin");
    const std::string text = "new";
    writeFileAtomically(folder.path / "link.bin", std::as_bytes(std::span(text)));
    EXPECT_TRUE(fs::is_symlink(folder.path / "link.bin"));
    EXPECT_EQ(readTextFile(folder.path / "real.bin"), "new");

    const fs::path pipe = folder.path / "pipe.bin";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
    writeFileAtomically(pipe, std::as_bytes(std::span(text)));
    char received[4] = {};
    EXPECT_EQ(::read(reader, received, 3), 3);
    ::close(reader);
    EXPECT_STREQ(received, "new");
    EXPECT_TRUE(fs::is_fifo(pipe));
    checkWritable(pipe);
    EXPECT_EQ(folder.fileCount(), 3u);
}

TEST(File, UnwritablePlacesAreInputErrors) {
    const TemporaryFolder folder;
    const auto problem = [](const fs::path& path) { return errorOf([&] { checkWritable(path); }); };
    EXPECT_NE(problem(folder.path / "no/such/out.png").hint().find("does not exist"), std::string::npos);
    EXPECT_EQ(problem(folder.path).fault(), Fault::Input);
    // Nobody can create files here, not even the superuser, whom permissions don't stop.
    EXPECT_EQ(problem("/proc/out.png").fault(), Fault::Input);
    checkWritable(folder.path / "out.png");
    EXPECT_EQ(folder.fileCount(), 0u);
}

TEST(File, HomeIsFoundFromTheProgramAndOverridden) {
    ASSERT_NE(std::getenv("TRILUME_HOME"), nullptr);
    const fs::path given = std::getenv("TRILUME_HOME");
    EXPECT_EQ(homeDirectory(), given);
    ::unsetenv("TRILUME_HOME");
    EXPECT_TRUE(fs::is_directory(homeDirectory() / "share/trilume/shaders"));
    ::setenv("TRILUME_HOME", given.c_str(), 1);
}

TEST(File, CacheFolderFollowsTheEnvironment) {
    const TemporaryFolder folder;
    ::setenv("XDG_CACHE_HOME", folder.path.c_str(), 1);
    EXPECT_EQ(cacheDirectory(), folder.path / "trilume");
    EXPECT_TRUE(fs::is_directory(folder.path / "trilume"));
    ::setenv("XDG_CACHE_HOME", "/proc/none", 1);
    EXPECT_TRUE(cacheDirectory().empty());
    ::unsetenv("XDG_CACHE_HOME");
}

TEST(File, HashIsFnv1a) {
    const std::string text = "foobar"; // Test vector of Fowler, Noll and Vo.
    EXPECT_EQ(hashBytes(std::as_bytes(std::span(text))), 0x85944171f73967e8ull);
    EXPECT_EQ(hashBytes({}), 0xcbf29ce484222325ull);
}

TEST(Pfm, BottomRowComesFirst) {
    const TemporaryFolder folder;
    const std::vector<float> rgb{1, 2, 3, 4, 5, 6}; // One pixel wide, two high.
    writePfm(folder.path / "x.pfm", 1, 2, rgb);
    const std::string bytes = readTextFile(folder.path / "x.pfm");
    const std::string header = "PF\n1 2\n-1.0\n";
    ASSERT_EQ(bytes.size(), header.size() + 24);
    EXPECT_EQ(bytes.substr(0, header.size()), header);
    float values[6];
    std::memcpy(values, bytes.data() + header.size(), sizeof values);
    EXPECT_EQ(std::vector<float>(values, values + 6), (std::vector<float>{4, 5, 6, 1, 2, 3}));
    EXPECT_THROW(writePfm(folder.path / "y.pfm", 2, 2, rgb), Error);
}

} // namespace
} // namespace trilume
