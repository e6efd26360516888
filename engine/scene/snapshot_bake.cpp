#include "scene/snapshot_bake.h"

#include <cmath>

namespace trilume::snapshot {
namespace {

/// What a value may be off by between keys, as a share of its change from one to the next; spans in which it is more
/// are halved, this often at most.
constexpr double kShare = 1e-3;
constexpr int kHalvings = 6;

/// Values that change at once.
template<class T>
constexpr bool kHolds = std::same_as<T, Existence> || std::same_as<T, Visibility> || std::same_as<T, MeshInstance> ||
                        std::same_as<T, MeshTopology>;

/// As the file keeps it: with the file's textures.
Light kept(Light light, TextureList& textures) {
    light.texture = textures.idOf(light.texture);
    return light;
}
Material kept(Material material, TextureList& textures) {
    const auto rename = [&](auto& field) {
        if constexpr (std::same_as<std::remove_cvref_t<decltype(field)>, TextureInput>)
            field.texture = textures.idOf(field.texture);
    };
    fields(rename, material);
    return material;
}
template<class C>
C kept(C component, TextureList&) {
    return component;
}

uint64_t digest(const Texture& texture) {
    Writer writer;
    writer.begin(Section::Textures);
    writer(texture);
    return checksum(writer.finish());
}

template<class T>
class TrackRecorder final : public Recorder {
public:
    TrackRecorder(Target target, uint32_t index, std::function<std::optional<T>()> now)
        : target_(target), index_(index), now_(std::move(now)) {}

    void record(double time) override {
        if (auto value = now_()) keys_[time] = {std::move(*value)};
    }

    void simplify(const std::vector<double>& samples) override {
        for (size_t i = 0; i + 1 < samples.size(); ++i) {
            const auto a = keys_.find(samples[i]), b = keys_.find(samples[i + 1]);
            if (a == keys_.end() || b == keys_.end() || std::next(a) == b) continue;
            for (const Blend blend : blends()) {
                const auto follows = [&](const auto& key) {
                    return same(between(a, b, key.first, blend), key.second.value);
                };
                if (!std::all_of(std::next(a), b, follows)) continue;
                a->second.blend = blend;
                a->second.settled = true;
                keys_.erase(std::next(a), b);
                break;
            }
        }
    }

    std::vector<std::pair<double, double>> openSpans() const override {
        std::vector<std::pair<double, double>> spans;
        for (auto a = keys_.begin(); a != keys_.end(); ++a)
            if (std::next(a) != keys_.end() && !a->second.settled) spans.emplace_back(a->first, std::next(a)->first);
        return spans;
    }

    bool settle(double a, double middle, double b, double share) override {
        const auto from = keys_.find(a), to = keys_.find(b);
        std::optional<T> value = now_();
        if (!value) return true; // not there: no matter what it would be
        double least = std::numeric_limits<double>::infinity();
        for (const Blend blend : blends()) {
            const T& first = from->second.value;
            const double off = deviation(between(from, to, middle, blend), *value, first, to->second.value, share);
            if (off >= least) continue;
            least = off;
            from->second.blend = blend;
        }
        return least <= 1;
    }

    void dropRepeats() override {
        for (auto key = keys_.begin(); key != keys_.end() && std::next(key) != keys_.end();) {
            const auto next = std::next(key);
            const bool repeats = key->second.blend == Blend::Hold && next->second.blend == Blend::Hold &&
                                 same(key->second.value, next->second.value);
            if (repeats)
                keys_.erase(next);
            else
                key = next;
        }
    }

    void write(Writer& writer) override {
        Track<T> track;
        for (auto& [time, key] : keys_) {
            track.times.push_back(time);
            track.blends.push_back(key.blend);
            track.values.push_back(std::move(key.value));
        }
        writer(target_);
        writer(index_);
        writer(track.times);
        writer(track.blends);
        writer(track.values);
    }

    size_t keys() const override { return keys_.size(); }

private:
    struct Key {
        T value;
        Blend blend = Blend::Hold;
        bool settled = false;
    };
    using Keys = std::map<double, Key>;

    static std::vector<Blend> blends() {
        if (kHolds<T>) return {Blend::Hold};
        if (std::same_as<T, LocalTransform>) return {Blend::Hold, Blend::Linear, Blend::Rigid};
        return {Blend::Hold, Blend::Linear};
    }
    static T between(typename Keys::const_iterator a, typename Keys::const_iterator b, double time, Blend blend) {
        return blended(a->second.value, b->second.value, (time - a->first) / (b->first - a->first), blend);
    }

    Target target_;
    uint32_t index_;
    std::function<std::optional<T>()> now_;
    Keys keys_;
};

} // namespace

// ---- what there is -----------------------------------------------------------------------------

void EntityList::refresh() {
    const World& world = scene_.world;
    bool changed = first_ || world.count<Name>() != alive_;
    if (!changed) world.eachChanged<Name>(seen_, [&](Entity, const Name&) { changed = true; });
    seen_ = world.now();
    if (!changed) return;
    alive_ = world.count<Name>();
    for (Entry& entry : entries_) entry.now = {};
    indices_.clear();
    std::unordered_map<std::string, size_t> seen;
    world.each<Name>([&](Entity entity, const Name& name) {
        std::vector<uint32_t>& same = byPath_[name.path];
        const size_t occurrence = seen[name.path]++;
        if (occurrence == same.size()) {
            same.push_back(static_cast<uint32_t>(entries_.size()));
            entries_.push_back({.path = name.path, .comesAndGoes = !first_});
        }
        entries_[same[occurrence]].now = entity;
        indices_[entity.index] = same[occurrence];
    });
    for (Entry& entry : entries_) {
        if (!entry.now) entry.comesAndGoes = true;
        const Parent* parent = entry.now ? world.find<Parent>(entry.now) : nullptr;
        if (const auto above = indices_.find(parent ? parent->entity.index : ~0u); above != indices_.end())
            entry.parent = above->second;
    }
    first_ = false;
}

TextureList::TextureList(const Scene& scene) : scene_(scene) {
    for (uint32_t slot = 0; slot < scene.textures().size(); ++slot) {
        ids_[{slot, scene.textures()[slot].revision}] = TextureId{slot};
        known_.push_back(digest(scene.textures()[slot]));
    }
}

TextureId TextureList::idOf(TextureId slot) {
    if (static_cast<size_t>(slot) >= scene_.textures().size()) return TextureId::None;
    const Texture& texture = scene_.texture(slot);
    const auto [entry, isNew] = ids_.try_emplace({static_cast<uint32_t>(slot), texture.revision});
    if (!isNew) return entry->second;
    // A file that was left and comes back stands in a new revision.
    const uint64_t sum = digest(texture);
    const auto same = std::find(known_.begin(), known_.end(), sum);
    entry->second = static_cast<TextureId>(same - known_.begin());
    if (same == known_.end()) {
        known_.push_back(sum);
        late_.push_back(texture);
    }
    return entry->second;
}

// ---- following it ------------------------------------------------------------------------------

Bake::Bake(Scene& scene, EntityList& entities, TextureList& textures)
    : scene_(scene), entities_(entities), textures_(textures) {
    for (const Material& material : scene.materials()) materialRevisions_.push_back(material.revision);
    for (const Mesh& mesh : scene.meshes()) meshRevisions_.emplace_back(mesh.topologyRevision, mesh.pointsRevision);
}

void Bake::moveTo(double time) {
    scene_.setTime(time);
    entities_.refresh();
}

template<class T>
void Bake::follow(Target target, uint32_t index, std::function<std::optional<T>()> now) {
    recorders_.push_back(std::make_unique<TrackRecorder<T>>(target, index, std::move(now)));
}

/// Of entities that come and go all components are followed: what makes them anew has to know them.
template<class C>
void Bake::followComponents(Target target, Tick since) {
    std::set<uint32_t> varying;
    scene_.world.eachChanged<C>(since, [&](Entity entity, const C&) { varying.insert(entities_.indexOf(entity)); });
    for (uint32_t i = 0; i < entities_.size(); ++i)
        if (entities_.comesAndGoes(i)) varying.insert(i);
    for (const uint32_t index : varying)
        follow<C>(target, index, [this, index]() -> std::optional<C> {
            const Entity entity = entities_.at(index);
            const C* component = entity ? scene_.world.find<C>(entity) : nullptr;
            if (component) return kept(*component, textures_);
            if (entity && std::same_as<C, Visibility>) return C{};
            return {};
        });
}

void Bake::followExistence() {
    for (uint32_t index = 0; index < entities_.size(); ++index)
        if (entities_.comesAndGoes(index))
            follow<Existence>(Target::Existence, index,
                              [this, index] { return Existence{.alive = bool(entities_.at(index))}; });
}

void Bake::followAssets() {
    for (uint32_t i = 0; i < scene_.materials().size(); ++i)
        if (i >= materialRevisions_.size() || scene_.materials()[i].revision != materialRevisions_[i])
            follow<Material>(Target::Material, i, [this, i] { return kept(scene_.materials()[i], textures_); });
    const auto followMeshes = [&](auto&& hasChanged, auto&& follower) {
        for (uint32_t i = 0; i < scene_.meshes().size(); ++i)
            if (i >= meshRevisions_.size() || hasChanged(scene_.meshes()[i], meshRevisions_[i])) follower(i);
    };
    followMeshes([](const Mesh& mesh, const auto& before) { return mesh.topologyRevision != before.first; },
                 [&](uint32_t i) {
                     follow<MeshTopology>(Target::MeshTopology, i, [this, i] {
                         const Mesh& mesh = scene_.meshes()[i];
                         return MeshTopology{mesh.triangles, mesh.uvs, mesh.triangleSubset};
                     });
                 });
    followMeshes([](const Mesh& mesh, const auto& before) { return mesh.pointsRevision != before.second; },
                 [&](uint32_t i) {
                     follow<MeshPoints>(Target::MeshPoints, i, [this, i] {
                         const Mesh& mesh = scene_.meshes()[i];
                         return MeshPoints{mesh.positions, mesh.normals};
                     });
                 });
}

void Bake::run(const std::vector<double>& times, const std::vector<double>& samples) {
    const Tick before = scene_.world.now();
    for (const double time : times) moveTo(time); // what varies, and what is not there yet
    followExistence();
    followComponents<LocalTransform>(Target::LocalTransform, before);
    followComponents<Visibility>(Target::Visibility, before);
    followComponents<MeshInstance>(Target::MeshInstance, before);
    followComponents<SphereInstance>(Target::SphereInstance, before);
    followComponents<Light>(Target::Light, before);
    followComponents<Camera>(Target::Camera, before);
    followAssets();
    for (const double time : times) {
        moveTo(time);
        for (const auto& recorder : recorders_) recorder->record(time);
    }
    std::erase_if(recorders_, [](const auto& recorder) { return recorder->keys() == 0; });

    std::map<std::pair<double, double>, std::vector<Recorder*>> open;
    for (const auto& recorder : recorders_) {
        recorder->simplify(samples);
        for (const auto& span : recorder->openSpans()) open[span].push_back(recorder.get());
    }
    for (auto& [span, recorders] : open) refine(span.first, span.second, std::move(recorders), 0);
    for (const auto& recorder : recorders_) recorder->dropRepeats();
}

/// Half the span may be off by twice its share: the same, as far as the picture is concerned.
void Bake::refine(double a, double b, std::vector<Recorder*> open, int halvings) {
    const double middle = 0.5 * (a + b);
    if (open.empty() || !(a < middle && middle < b)) return;
    moveTo(middle);
    const double share = std::ldexp(kShare, halvings);
    std::erase_if(open, [&](Recorder* recorder) { return recorder->settle(a, middle, b, share); });
    if (halvings == kHalvings) return;
    for (Recorder* recorder : open) recorder->record(middle);
    refine(a, middle, open, halvings + 1);
    refine(middle, b, std::move(open), halvings + 1);
}

void Bake::write(Writer& writer) const {
    writer(uint64_t{recorders_.size()});
    for (const auto& recorder : recorders_) recorder->write(writer);
}

size_t Bake::keys() const {
    size_t sum = 0;
    for (const auto& recorder : recorders_) sum += recorder->keys();
    return sum;
}

} // namespace trilume::snapshot
