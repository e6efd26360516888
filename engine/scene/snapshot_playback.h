#pragma once

#include "scene/scene.h"
#include "scene/snapshot_stream.h"

#include <memory>
#include <string>
#include <vector>

/// From tracks to a scene that follows time.
namespace trilume::snapshot {

/// An entity that a snapshot knows; it may come and go.
struct KnownEntity {
    std::string path;
    uint32_t parent = ~0u;
    Entity now;
};

/// Gives an entity that was created its name, and its parent if that is there.
void dress(Scene& scene, const std::vector<KnownEntity>& entities, uint32_t index);

/// Throws inputError for a mesh whose arrays do not fit each other.
void checkMesh(const Mesh& mesh, const std::string& where);

class Playback;

/// A track that knows what it changes.
class Player {
public:
    virtual ~Player() = default;
    virtual void apply(Playback& playback, double time) const = 0;
    virtual void addTimes(std::vector<double>& times) const = 0;
};

/// The source of a scene that was read from a snapshot.
class Playback final : public SceneSource {
public:
    /// Reads the tracks. `restricted`: the stage goes on before and after the scene's time range. The scene outlives
    /// this.
    Playback(Scene& scene, std::vector<KnownEntity> entities, bool restricted, Reader& reader);

    /// Throws inputError, at each call anew, at times for which the file holds a mesh whose arrays do not fit.
    void setTime(double timeCode) override;
    std::vector<double> sampleTimes() const override;
    bool varies() const { return !players_.empty(); }

    // For tracks.
    Scene& scene() { return scene_; }
    KnownEntity& entity(uint32_t index) { return entities_[index]; }
    void setAlive(uint32_t index, bool alive);

private:
    Scene& scene_;
    std::vector<KnownEntity> entities_;
    std::vector<std::unique_ptr<Player>> players_;
    std::vector<std::pair<uint64_t, uint64_t>> checked_; ///< by mesh: the revisions that were found sound
    bool restricted_;
};

} // namespace trilume::snapshot
