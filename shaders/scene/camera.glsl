// Camera rays: thin lens, box pixel filter.
#ifndef TL_SCENE_CAMERA_GLSL
#define TL_SCENE_CAMERA_GLSL

#include "lib/sampling.glsl"
#include "scene/bindings.glsl"

struct CameraRay {
    vec3 origin;
    vec3 direction; // unit
    float tMin;
    float tMax;
};

// `film` in [0,1]^2 from the upper left corner, `lens` in [0,1)^2.
CameraRay cameraRay(vec2 film, vec2 lens) {
    const Camera camera = TL_FRAME.camera;
    const vec3 through = camera.filmCorner + film.x * camera.filmU + film.y * camera.filmV; // at distance 1 on the axis
    CameraRay ray;
    ray.origin = camera.position;
    ray.direction = through;
    if (camera.lensRadius > 0.0) {
        const vec2 p = camera.lensRadius * sampleDisk(lens);
        const vec3 onLens = p.x * camera.right + p.y * camera.up;
        ray.origin += onLens;
        ray.direction = camera.focusDistance * through - onLens;
    }
    ray.direction = normalize(ray.direction);
    // Clipping planes are distances along the axis.
    const float cosAxis = dot(ray.direction, camera.forward);
    ray.tMin = camera.nearClip / cosAxis;
    ray.tMax = camera.farClip / cosAxis;
    return ray;
}

// Film position in [0,1]^2 of a point in front of the given camera's pinhole; false behind it.
bool projectToFilm(Camera camera, vec3 position, out vec2 film) {
    const vec3 d = position - camera.position;
    const float z = dot(d, camera.forward);
    film = vec2(0.0);
    if (z <= 0.0) return false;
    const vec3 offset = d / z - camera.filmCorner;
    film = vec2(dot(offset, camera.filmU) / dot(camera.filmU, camera.filmU),
                dot(offset, camera.filmV) / dot(camera.filmV, camera.filmV));
    return true;
}

#endif
