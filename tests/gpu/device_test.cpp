#include "gpu/gpu_fixture.h"

#include "core/error.h"

#include <numeric>

using namespace trilume;
using trilume::test::GpuTest;

namespace {

struct ScalePush {
    VkDeviceAddress in, out;
    float factor;
    uint32_t count;
};
const char* const kScale = R"(
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { floatRef source; floatRef result; float factor; uint count; } push;
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i < push.count) push.result.v[i] = push.source.v[i] * push.factor;
}
)";

class DeviceTest : public GpuTest {};

TEST_F(DeviceTest, buffersKeepWhatIsUploaded) {
    std::vector<uint32_t> data(100'003);
    std::iota(data.begin(), data.end(), 7u);
    EXPECT_EQ(read<uint32_t>(bufferOf(data), data.size()), data);
}

TEST_F(DeviceTest, dispatchCoversEveryThread) {
    std::vector<float> data(1001);
    std::iota(data.begin(), data.end(), 0.f);
    const auto in = bufferOf(data);
    const auto out = bufferFor<float>(data.size());
    runCompute(kScale, ScalePush{in.address(), out.address(), 3, 1001}, 1001);
    const auto result = read<float>(out, data.size());
    for (size_t i = 0; i < data.size(); ++i) ASSERT_EQ(result[i], 3 * data[i]) << i;
}

} // namespace
