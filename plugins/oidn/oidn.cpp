#include "oidn.h"

#include "core/error.h"
#include "core/file.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <memory>

namespace trilume {

namespace {

namespace fs = std::filesystem;

constexpr const char* kLibrary = "libOpenImageDenoise.so.2";

struct OidnDevice;
struct OidnFilter;

/// What is used of the C API of Open Image Denoise 2.
struct Api {
    static constexpr int kDeviceCpu = 1, kFloat3 = 3;

    OidnDevice* (*newDevice)(int type);
    void (*commitDevice)(OidnDevice*);
    void (*releaseDevice)(OidnDevice*);
    int (*getDeviceError)(OidnDevice*, const char** message);
    OidnFilter* (*newFilter)(OidnDevice*, const char* type);
    void (*setSharedFilterImage)(OidnFilter*, const char* name, void* pixels, int format, size_t width, size_t height,
                                 size_t byteOffset, size_t bytesPerPixel, size_t bytesPerRow);
    void (*setFilterBool)(OidnFilter*, const char* name, bool value);
    void (*commitFilter)(OidnFilter*);
    void (*executeFilter)(OidnFilter*);
    void (*releaseFilter)(OidnFilter*);
};

/// The one that TRILUME_OIDN names, else that of pyoidn in the checkout's Python environment, else the system's.
void* openLibrary() {
    const auto open = [](const fs::path& path) { return dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL); };
    if (const char* path = std::getenv("TRILUME_OIDN")) return open(path);
    for (const fs::path& folder :
         {homeDirectory() / TRILUME_PYTHON_SITE_PACKAGES_FROM_HOME, fs::path(TRILUME_PYTHON_SITE_PACKAGES)})
        if (void* library = open(folder / "pyoidn/oidn/lib" / kLibrary)) return library;
    return open(kLibrary);
}

/// Loaded once; it stays, as its threads do.
const Api& api() {
    static const Api loaded = [] {
        void* library = openLibrary();
        if (!library)
            throw inputError("Open Image Denoise is not installed", kLibrary,
                             "run tools/bootstrap --oidn, or choose another denoiser");
        Api api{};
        const auto bind = [&](auto*& function, const char* name) {
            function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(dlsym(library, name));
            if (!function)
                throw inputError(std::string("Open Image Denoise lacks ") + name, kLibrary,
                                 "install version 2.0 or newer");
        };
        bind(api.newDevice, "oidnNewDevice");
        bind(api.commitDevice, "oidnCommitDevice");
        bind(api.releaseDevice, "oidnReleaseDevice");
        bind(api.getDeviceError, "oidnGetDeviceError");
        bind(api.newFilter, "oidnNewFilter");
        bind(api.setSharedFilterImage, "oidnSetSharedFilterImage");
        bind(api.setFilterBool, "oidnSetFilterBool");
        bind(api.commitFilter, "oidnCommitFilter");
        bind(api.executeFilter, "oidnExecuteFilter");
        bind(api.releaseFilter, "oidnReleaseFilter");
        return api;
    }();
    return loaded;
}

void checkDevice(OidnDevice* device) {
    const char* message = nullptr;
    if (api().getDeviceError(device, &message) != 0)
        throw runError("Open Image Denoise failed", message ? message : "without a message", "use another denoiser");
}

using Device = std::unique_ptr<OidnDevice, void (*)(OidnDevice*)>;

void applyFilter(OidnDevice* device, ImageData& picture, const ImageData& albedo, const ImageData& normal) {
    const std::unique_ptr<OidnFilter, void (*)(OidnFilter*)> filter(api().newFilter(device, "RT"), api().releaseFilter);
    checkDevice(device);
    const auto setImage = [&](const char* name, const ImageData& image) {
        // The library declares its inputs mutable and leaves them as they are.
        api().setSharedFilterImage(filter.get(), name, const_cast<float*>(image.pixels.data()), Api::kFloat3,
                                   image.width, image.height, 0, image.channels * sizeof(float), 0);
    };
    ImageData result = picture;
    setImage("color", picture);
    setImage("albedo", albedo);
    setImage("normal", normal);
    setImage("output", result);
    api().setFilterBool(filter.get(), "hdr", true);
    api().commitFilter(filter.get());
    api().executeFilter(filter.get());
    checkDevice(device);
    picture = std::move(result);
}

} // namespace

ImageFilter makeOidnFilter() {
    // On the CPU: it reads the pictures where they are, and gives the same on every machine's graphics card.
    const auto device = std::make_shared<Device>(api().newDevice(Api::kDeviceCpu), api().releaseDevice);
    checkDevice(device->get());
    api().commitDevice(device->get());
    checkDevice(device->get());
    return [device](ImageData& picture, const ImageData& albedo, const ImageData& normal) {
        applyFilter(device->get(), picture, albedo, normal);
    };
}

} // namespace trilume
