#pragma once

#include "scene/scene.h"
#include "scene/snapshot_stream.h"
#include "scene/snapshot_track.h"

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

/// From a scene that a source moves to tracks of what it does.
namespace trilume::snapshot {

/// Every entity that was ever there, by path. Sources may destroy and make them anew.
class EntityList {
public:
    explicit EntityList(const Scene& scene) : scene_(scene) { refresh(); }

    /// Looks again after the scene has moved.
    void refresh();
    size_t size() const { return entries_.size(); }
    /// As it stands now; none: not there.
    Entity at(uint32_t index) const { return entries_[index].now; }
    uint32_t indexOf(Entity entity) const { return indices_.at(entity.index); }
    bool comesAndGoes(uint32_t index) const { return entries_[index].comesAndGoes; }
    const std::string& path(uint32_t index) const { return entries_[index].path; }
    uint32_t parent(uint32_t index) const { return entries_[index].parent; }

private:
    struct Entry {
        std::string path;
        uint32_t parent = ~0u;
        Entity now;
        bool comesAndGoes = false;
    };
    const Scene& scene_;
    std::vector<Entry> entries_;
    std::unordered_map<std::string, std::vector<uint32_t>> byPath_; ///< several may have the same
    std::unordered_map<uint32_t, uint32_t> indices_;                ///< by the entity's own
    size_t alive_ = 0;
    Tick seen_ = 0;
    bool first_ = true;
};

/// Every picture that a slot of the scene ever held, under an id of its own.
class TextureList {
public:
    explicit TextureList(const Scene& scene);

    TextureId idOf(TextureId slot);
    size_t size() const { return known_.size(); }
    /// Those that came after the scene's first ones.
    const std::vector<Texture>& late() const { return late_; }

private:
    const Scene& scene_;
    std::map<std::pair<uint32_t, uint64_t>, TextureId> ids_; ///< by slot and revision
    std::vector<uint64_t> known_;                            ///< checksums
    std::vector<Texture> late_;
};

/// One value of the scene on its way to be a track.
class Recorder {
public:
    virtual ~Recorder() = default;
    /// Makes the present value the key of this time.
    virtual void record(double time) = 0;
    /// Leaves out keys that follow exactly from those of the samples around them.
    virtual void simplify(const std::vector<double>& samples) = 0;
    /// Pairs of keys between which nothing is known yet.
    virtual std::vector<std::pair<double, double>> openSpans() const = 0;
    /// Chooses the blend from a to b by the present value, which is that in the middle; false when even the best one is
    /// off by more than `share` of the change from a to b.
    virtual bool settle(double a, double middle, double b, double share) = 0;
    /// Leaves out keys from which and to which the same value holds.
    virtual void dropRepeats() = 0;
    /// Once: takes the values along.
    virtual void write(Writer& writer) = 0;
    virtual size_t keys() const = 0;
};

/// Plays the scene and writes what varies.
class Bake {
public:
    Bake(Scene& scene, EntityList& entities, TextureList& textures);

    /// `times` contain the samples.
    void run(const std::vector<double>& times, const std::vector<double>& samples);
    void write(Writer& writer) const;
    size_t tracks() const { return recorders_.size(); }
    size_t keys() const;

private:
    void moveTo(double time);
    template<class T>
    void follow(Target target, uint32_t index, std::function<std::optional<T>()> now);
    template<class C>
    void followComponents(Target target, Tick since);
    void followExistence();
    void followAssets();
    void refine(double a, double b, std::vector<Recorder*> open, int halvings);

    Scene& scene_;
    EntityList& entities_;
    TextureList& textures_;
    std::vector<uint64_t> materialRevisions_; ///< before the scene moved
    std::vector<std::pair<uint64_t, uint64_t>> meshRevisions_;
    std::vector<std::unique_ptr<Recorder>> recorders_; ///< in the order of Target
};

} // namespace trilume::snapshot
