// Raises the light of a volume's probes to what tally.comp expects of all bounces. One thread to a node.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeUpdatePush push; };

#include "scene/bindings.glsl"

layout(local_size_x = 64) in;

void main() {
    ProbeVolume volume = push.volume.v[0];
    const uint node = gl_GlobalInvocationID.x;
    if (node < volume.probeCount * kProbeIrradianceNodes) volume.irradiance.v[node] *= volume.growth;
}
