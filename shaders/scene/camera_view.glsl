// The camera as paths from lights meet it: where a point falls on the film.
#ifndef TL_SCENE_CAMERA_VIEW_GLSL
#define TL_SCENE_CAMERA_VIEW_GLSL

#include "scene/camera.glsl"
#include "scene/visible.glsl"

struct CameraView {
    vec3 lens;           // a point on the lens
    vec3 wi;             // unit, towards it
    float distance;      // 0: out of sight
    float clip;          // what is closer to the lens than this doesn't block
    vec2 film;           // in [0,1)^2, as cameraRay takes it
    float pdfSolidAngle; // with which cameraRay, for uniform film positions, leaves the lens along -wi
};

// `lens` in [0,1)^2. The density of film positions, 1 / filmArea at distance 1 along the axis, is one of directions by
// 1 / cos^3; the same holds for any point of the lens, through the plane in focus.
CameraView viewFromCamera(vec3 position, vec2 lens) {
    const Camera camera = TL_FRAME.camera;
    CameraView view;
    view.lens = camera.position;
    vec3 onLens = vec3(0.0);
    if (camera.lensRadius > 0.0) {
        const vec2 p = camera.lensRadius * sampleDisk(lens);
        onLens = p.x * camera.right + p.y * camera.up;
        view.lens += onLens;
    }
    const vec3 toPoint = position - view.lens;
    const float depth = dot(toPoint, camera.forward);
    view.distance = 0.0;
    if (!(depth > camera.nearClip && depth < camera.farClip)) return view;
    vec3 through = toPoint / depth;
    if (camera.lensRadius > 0.0) through += onLens / camera.focusDistance;
    const vec3 offset = through - camera.filmCorner;
    view.film = vec2(dot(offset, camera.filmU) / dot(camera.filmU, camera.filmU),
                     dot(offset, camera.filmV) / dot(camera.filmV, camera.filmV));
    if (any(lessThan(view.film, vec2(0.0))) || any(greaterThanEqual(view.film, vec2(1.0)))) return view;
    view.distance = length(toPoint);
    view.wi = -toPoint / view.distance;
    const float cosAxis = depth / view.distance;
    view.clip = camera.nearClip / cosAxis;
    view.pdfSolidAngle = 1.0 / (camera.filmArea * cosAxis * cosAxis * cosAxis);
    return view;
}

// Share of light that gets from surface `s` of `instance` to the lens.
float visibilityToCamera(Surface s, uint instance, CameraView view) {
    if ((TL_SCENE.instances.v[instance].mask & kMaskCamera) == 0u) return 0.0;
    const vec3 origin = offsetRayOrigin(s.position, sideTowards(s, view.wi), s.extent);
    return segmentVisibility(origin, view.lens + view.clip * -view.wi - origin, 1.0, kMaskCamera);
}

#endif
