#pragma once

#include "mesh_builder.h"
#include "python.h"
#include "usd_stage.h"

#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

namespace trilume::usd {

/// Turns what the Python side hands out into the scene's assets and entities: all of it once, then what varies.
/// The numbers of materials, assets and placements are those of the Python `Stage`. Needs the global lock, except for
/// its destructor, setTime and sampleTimes, which take it.
class StageSource final : public SceneSource {
public:
    /// `stage`: a trilume_usd.Stage. Fills `scene`, which outlives this.
    StageSource(py::object stage, Scene& scene, ReadTexture readTexture);
    ~StageSource() override;

    void setTime(double timeCode) override;
    std::vector<double> sampleTimes() const override;
    bool varies() const;

private:
    enum class Kind { Mesh, Sphere, Light, Camera };

    /// What placements share, in the engine's terms.
    struct Asset {
        std::string path;
        Kind kind = Kind::Mesh;
        bool varying = false;
        bool present = false; ///< at the present time; a mesh without faces is not
        MeshId mesh = MeshId::None;
        Topology topology; ///< of deforming meshes
        SphereInstance sphere;
        Light light;
        Camera camera;
        std::vector<size_t> placements;
    };
    struct Placement {
        size_t asset = 0;
        std::vector<MaterialId> materials;
        std::vector<Entity> entities; ///< by copy
    };

    static Kind kindFrom(const std::string& name);
    void load();
    void loadStageFacts();
    void loadMaterial(size_t number, const py::object& record, const std::string& path);
    void loadPlacement(const py::object& description);
    void updateMaterial(size_t number, const py::object& record);
    void updateAsset(Asset& asset, const py::object& record);
    void readAsset(Asset& asset, const py::object& record);
    void readMesh(Asset& asset, const py::dict& record);
    Mesh buildMeshOf(Asset& asset, const py::dict& record);
    bool followPoints(Asset& asset, const py::dict& record);
    void logOnce(const Asset& asset, const Problem& problem);
    void place(size_t number, const py::object& sample);
    py::object placementAt(size_t number) const;
    Entity createCopy(const Placement& placement, std::string name);
    void assignComponent(const Asset& asset, const Placement& placement, Entity entity);
    glm::dmat4 localTransform(const Asset& asset, const glm::dmat4& stageFromLocal) const;
    TextureId findTexture(const std::string& file, ColorSpace space, std::optional<Wrap> s, std::optional<Wrap> t);
    TextureId placeTexture(Texture texture);
    void releaseTextures();
    void logWarnings();
    void checkVisible() const;

    py::object stage_;
    Scene& scene_;
    ReadTexture readTexture_;
    glm::dmat4 worldFromStage_{1}; ///< metres, Y up
    Entity root_;
    std::vector<MaterialId> materials_;
    std::vector<py::object> materialRecords_; ///< of those that vary: the last one
    std::vector<Asset> assets_;
    std::vector<Placement> placements_;
    std::set<std::pair<std::string, std::string_view>> logged_; ///< path and what: numbers change with time
    std::map<std::tuple<std::string, ColorSpace, std::optional<Wrap>, std::optional<Wrap>>, TextureId> textures_;
    std::vector<TextureId> freeTextures_;
    bool texturesAdded_ = false; ///< since the last release
};

} // namespace trilume::usd
