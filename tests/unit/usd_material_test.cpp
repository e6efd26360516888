#include "reader/python.h"
#include "usd_stage_fixture.h"

// What materials mean: UsdPreviewSurface, standard_surface, OpenPBR, textures, bindings.
namespace trilume::usd {
namespace {

std::string shader(std::string_view id, std::string_view inputs) {
    return "def Material \"mat\"\n{\ntoken outputs:surface.connect = </mat/s.outputs:surface>\ndef Shader \"s\"\n{\n"
           "uniform token info:id = \"" +
           std::string(id) + "\"\n" + std::string(inputs) + "token outputs:surface\n}\n" + R"(
def Shader "st"
{
    uniform token info:id = "UsdPrimvarReader_float2"
    string inputs:varname = "st"
    float2 outputs:result
}
def Shader "place"
{
    uniform token info:id = "UsdTransform2d"
    float2 inputs:in.connect = </mat/st.outputs:result>
    float inputs:rotation = 90
    float2 inputs:scale = (2, 3)
    float2 inputs:translation = (10, 20)
    float2 outputs:result
}
def Shader "tex"
{
    uniform token info:id = "UsdUVTexture"
    asset inputs:file = @tex.png@
    float2 inputs:st.connect = </mat/place.outputs:result>
    token inputs:wrapS = "clamp"
    token inputs:wrapT = "mirror"
    token inputs:sourceColorSpace = "raw"
    float4 inputs:scale = (2, 3, 4, 5)
    float4 inputs:bias = (0.1, 0.2, 0.3, 0.4)
    float4 inputs:fallback = (0.5, 0.25, 0.125, 0.75)
    float3 outputs:rgb
    float outputs:g
    float outputs:a
}
def Shader "image"
{
    uniform token info:id = "ND_image_color3"
    asset inputs:file = @tex.png@ (colorSpace = "srgb_texture")
    color3f outputs:out
}
def Shader "weight"
{
    uniform token info:id = "ND_image_float"
    asset inputs:file = @weight.png@
    float outputs:out
}
def Shader "color"
{
    uniform token info:id = "UsdPrimvarReader_float3"
    string inputs:varname = "displayColor"
    float3 outputs:result
}
}
)";
}

std::string bound(std::string_view more = "") {
    return square("m", "rel material:binding = </mat>\n" + std::string(more));
}

class UsdMaterial : public UsdStage {
protected:
    void SetUp() override {
        UsdStage::SetUp();
        write("tex.png", "x");
        write("weight.png", "x");
    }
    Material preview(std::string_view inputs, std::string_view mesh = "") const {
        scene_ = read(shader("UsdPreviewSurface", inputs) + bound(mesh));
        return materialOf(*scene_, "/m");
    }
    mutable std::unique_ptr<Scene> scene_;
};

TEST_F(UsdMaterial, PreviewSurfaceConstants) {
    const Material m =
        preview("color3f inputs:diffuseColor = (0.1, 0.2, 0.3)\ncolor3f inputs:emissiveColor = (4, 5, 6)\n"
                "float inputs:metallic = 0.7\nfloat inputs:roughness = 0.3\nfloat inputs:ior = 1.8\n"
                "float inputs:clearcoat = 0.4\nfloat inputs:clearcoatRoughness = 0.05\n");
    EXPECT_EQ(m.baseColor, glm::vec3(0.1f, 0.2f, 0.3f));
    EXPECT_EQ(m.emission, glm::vec3(4, 5, 6));
    EXPECT_FLOAT_EQ(m.metallic, 0.7f);
    EXPECT_FLOAT_EQ(m.roughness, 0.3f);
    EXPECT_FLOAT_EQ(m.ior, 1.8f);
    EXPECT_FLOAT_EQ(m.clearcoat, 0.4f);
    EXPECT_FLOAT_EQ(m.clearcoatRoughness, 0.05f);
    EXPECT_EQ(m.opacity, 1);
    EXPECT_EQ(m.name, "/mat");
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdMaterial, PreviewSurfaceDefaults) {
    const Material m = preview("");
    EXPECT_EQ(m.baseColor, glm::vec3(0.18f));
    EXPECT_EQ(m.roughness, 0.5f);
    EXPECT_EQ(m.ior, 1.5f);
    EXPECT_EQ(m.transmission, 0);
    EXPECT_FALSE(m.specularWorkflow);
}

TEST_F(UsdMaterial, SpecularWorkflow) {
    const Material m = preview("int inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (0.9, 0.8, "
                               "0.7)\nfloat inputs:metallic = 1\n");
    EXPECT_TRUE(m.specularWorkflow);
    EXPECT_EQ(m.specularColor, glm::vec3(0.9f, 0.8f, 0.7f));
    EXPECT_EQ(m.metallic, 0);
}

TEST_F(UsdMaterial, TransparentDielectricsRefract) {
    const Material m = preview("float inputs:opacity = 0\nfloat inputs:ior = 1.33\nfloat inputs:roughness = 0\ncolor3f "
                               "inputs:diffuseColor = (1, 0.9, 0.8)\n");
    EXPECT_EQ(m.transmission, 1);
    EXPECT_EQ(m.opacity, 1);
    EXPECT_EQ(m.transmissionColor, glm::vec3(1, 0.9f, 0.8f));
    EXPECT_FLOAT_EQ(preview("float inputs:opacity = 0.25\n").transmission, 0.75f);
}

TEST_F(UsdMaterial, OtherOpacitiesCutOut) {
    Material m = preview("float inputs:opacity = 0.25\ntoken inputs:opacityMode = \"presence\"\n");
    EXPECT_EQ(m.transmission, 0);
    EXPECT_EQ(m.opacity, 0.25f);
    m = preview("float inputs:opacity = 0.25\nfloat inputs:opacityThreshold = 0.5\n");
    EXPECT_EQ(m.transmission, 0);
    EXPECT_EQ(m.opacityThreshold, 0.5f);
    m = preview("float inputs:opacity = 0.25\nfloat inputs:metallic = 1\n");
    EXPECT_EQ(m.transmission, 0);
    EXPECT_EQ(m.opacity, 0.25f);
    m = preview("float inputs:opacity.connect = </mat/tex.outputs:a>\n");
    EXPECT_EQ(m.transmission, 0);
    EXPECT_NE(m.opacityMap.texture, TextureId::None);
    EXPECT_EQ(m.opacityMap.channel, 3);
}

TEST_F(UsdMaterial, TexturesWithCoordinatesAndWraps) {
    const Material m = preview("color3f inputs:diffuseColor.connect = </mat/tex.outputs:rgb>\nfloat "
                               "inputs:roughness.connect = </mat/tex.outputs:g>\n");
    ASSERT_NE(m.baseColorMap.texture, TextureId::None);
    EXPECT_EQ(m.baseColorMap.texture, m.roughnessMap.texture) << "one file, one texture";
    EXPECT_EQ(m.baseColorMap.channel, -1);
    EXPECT_EQ(m.roughnessMap.channel, 1);
    EXPECT_EQ(m.baseColorMap.scale, glm::vec4(2, 3, 4, 5));
    EXPECT_EQ(m.baseColorMap.bias, glm::vec4(0.1f, 0.2f, 0.3f, 0.4f));
    // Scale, then a quarter turn counter-clockwise, then translation: (1, 1) -> (2, 3) -> (-3, 2) -> (7, 22).
    const glm::vec2 st = m.baseColorMap.uvTransform * glm::vec3(1, 1, 1);
    EXPECT_NEAR(st.x, 7, 1e-5);
    EXPECT_NEAR(st.y, 22, 1e-5);
    const Texture& texture = scene_->texture(m.baseColorMap.texture);
    EXPECT_EQ(texture.wrapS, Wrap::Clamp);
    EXPECT_EQ(texture.wrapT, Wrap::Mirror);
    EXPECT_FALSE(texture.srgb);
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdMaterial, MissingAndUnreadableTexturesFallBack) {
    std::filesystem::remove(folder_ / "tex.png");
    Material m = preview("color3f inputs:diffuseColor.connect = </mat/tex.outputs:rgb>\nfloat inputs:roughness.connect "
                         "= </mat/tex.outputs:g>\n");
    EXPECT_EQ(m.baseColorMap.texture, TextureId::None);
    EXPECT_EQ(m.baseColor, glm::vec3(0.5f, 0.25f, 0.125f));
    EXPECT_EQ(m.roughness, 0.25f);
    EXPECT_TRUE(warned("/mat/tex: texture not found: tex.png"));
    EXPECT_EQ(warnings_.size(), 1u) << allWarnings();
    write("tex.png", "");
    m = preview("color3f inputs:diffuseColor.connect = </mat/tex.outputs:rgb>\n");
    EXPECT_EQ(m.baseColor, glm::vec3(0.5f, 0.25f, 0.125f));
    EXPECT_TRUE(warned("the image is empty")) << allWarnings();
}

TEST_F(UsdMaterial, DisplayColorThroughAPrimvarReader) {
    EXPECT_EQ(preview("color3f inputs:diffuseColor.connect = </mat/color.outputs:result>\n",
                      "color3f[] primvars:displayColor = [(0, 1, 0)]\n")
                  .baseColor,
              glm::vec3(0, 1, 0));
}

TEST_F(UsdMaterial, NoMaterialTakesDisplayColorAsLambert) {
    const auto scene = read(square("a", "color3f[] primvars:displayColor = [(0, 1, 0)]\n") + square("b") +
                            square("c", "color3f[] primvars:displayColor = [(0, 0, 0), (1, 1, 1), (0, 0, 0), (1, 1, "
                                        "1)] (interpolation = \"vertex\")\n"));
    EXPECT_EQ(materialOf(*scene, "/a").baseColor, glm::vec3(0, 1, 0));
    EXPECT_EQ(materialOf(*scene, "/a").ior, 1);
    EXPECT_EQ(materialOf(*scene, "/b").baseColor, glm::vec3(0.18f));
    EXPECT_EQ(materialOf(*scene, "/b").ior, 1);
    EXPECT_EQ(materialOf(*scene, "/c").baseColor, glm::vec3(0.5f));
    EXPECT_TRUE(warned("/c: displayColor varies"));
}

TEST_F(UsdMaterial, SubsetsHaveTheirOwn) {
    const auto scene = read(shader("UsdPreviewSurface", "color3f inputs:diffuseColor = (1, 0, 0)\n") + R"(
def Mesh "m"
{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
    def GeomSubset "part" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
        rel material:binding = </mat>
    }
}
)");
    EXPECT_EQ(meshOf(*scene, "/m").triangleSubset, (std::vector<uint32_t>{0, 1}));
    EXPECT_EQ(materialOf(*scene, "/m", 0).baseColor, glm::vec3(0.18f));
    EXPECT_EQ(materialOf(*scene, "/m", 1).baseColor, glm::vec3(1, 0, 0));
}

TEST_F(UsdMaterial, CoordinatesFromThePrimvarThatTheMaterialNames) {
    std::string material =
        shader("UsdPreviewSurface", "color3f inputs:diffuseColor.connect = </mat/tex.outputs:rgb>\n");
    const std::string name = "varname = \"st\"";
    material.replace(material.find(name), name.size(), "varname = \"other\"");
    const auto scene =
        read(material + bound("texCoord2f[] primvars:st = [(1, 1)] (interpolation = \"constant\")\n"
                              "texCoord2f[] primvars:other = [(2, 2)] (interpolation = \"constant\")\n"));
    EXPECT_EQ(meshOf(*scene, "/m").uvs[0], glm::vec2(2, 2));
}

TEST_F(UsdMaterial, StandardSurface) {
    const auto scene = read(
        shader("ND_standard_surface_surfaceshader",
               "float inputs:base = 0.5\ncolor3f inputs:base_color = (0.2, 0.4, 0.6)\nfloat inputs:metalness = 0.1\n"
               "float inputs:specular = 0.9\nfloat inputs:specular_roughness = 0.35\nfloat inputs:specular_IOR = 1.7\n"
               "float inputs:transmission = 0.8\ncolor3f inputs:transmission_color = (0.9, 1, 1)\nfloat inputs:coat = "
               "0.3\n"
               "float inputs:emission = 2\ncolor3f inputs:emission_color = (1, 2, 3)\nfloat inputs:sheen = 1\n") +
        bound());
    const Material& m = materialOf(*scene, "/m");
    EXPECT_EQ(m.baseColor, glm::vec3(0.1f, 0.2f, 0.3f));
    EXPECT_FLOAT_EQ(m.metallic, 0.1f);
    EXPECT_FLOAT_EQ(m.specular, 0.9f);
    EXPECT_FLOAT_EQ(m.roughness, 0.35f);
    EXPECT_FLOAT_EQ(m.ior, 1.7f);
    EXPECT_FLOAT_EQ(m.transmission, 0.8f);
    EXPECT_EQ(m.transmissionColor, glm::vec3(0.9f, 1, 1));
    EXPECT_FLOAT_EQ(m.clearcoat, 0.3f);
    EXPECT_FLOAT_EQ(m.clearcoatRoughness, 0.1f);
    EXPECT_EQ(m.emission, glm::vec3(2, 4, 6));
    EXPECT_TRUE(warned("/mat/s: sheen is not supported"));
    EXPECT_EQ(warnings_.size(), 1u) << allWarnings();
}

TEST_F(UsdMaterial, OpenPbrWithAnImage) {
    const auto scene =
        read(shader("ND_open_pbr_surface_surfaceshader",
                    "float inputs:base_weight = 0.5\ncolor3f inputs:base_color.connect = </mat/image.outputs:out>\n"
                    "float inputs:base_metalness = 1\nfloat inputs:specular_roughness = 0.2\n"
                    "float inputs:emission_luminance = 10\ncolor3f inputs:emission_color = (1, 0.5, 0)\n"
                    "float inputs:geometry_opacity = 0.5\n") +
             bound());
    const Material& m = materialOf(*scene, "/m");
    ASSERT_NE(m.baseColorMap.texture, TextureId::None);
    EXPECT_EQ(m.baseColorMap.scale, glm::vec4(0.5f, 0.5f, 0.5f, 1));
    EXPECT_TRUE(scene->texture(m.baseColorMap.texture).srgb);
    EXPECT_EQ(m.metallic, 1);
    EXPECT_EQ(m.emission, glm::vec3(10, 5, 0));
    EXPECT_EQ(m.opacity, 0.5f);
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdMaterial, UnsupportedShadersAreNamed) {
    auto scene = read(shader("MyOwnSurface", "") + bound());
    EXPECT_EQ(materialOf(*scene, "/m").baseColor, glm::vec3(0.18f));
    EXPECT_TRUE(warned("/mat: surface shader MyOwnSurface is not supported"));
    warnings_.clear();
    std::string material =
        shader("UsdPreviewSurface", "color3f inputs:diffuseColor.connect = </mat/tex.outputs:rgb>\n");
    material.replace(material.find("UsdUVTexture"), 12, "MyOwnTexture");
    scene = read(material + bound());
    EXPECT_EQ(materialOf(*scene, "/m").baseColor, glm::vec3(0.18f));
    EXPECT_TRUE(warned("/mat/tex: shader MyOwnTexture is not supported"));
}

TEST_F(UsdMaterial, UnsupportedMaterialXDoesNotHideTheUniversalSurface) {
    std::string material = shader("UsdPreviewSurface", "color3f inputs:diffuseColor = (1, 0, 0)\n");
    const std::string output = "token outputs:surface.connect";
    material.insert(material.find(output), "token outputs:mtlx:surface.connect = </mat/x.outputs:surface>\n"
                                           "def Shader \"x\"\n{\nuniform token info:id = \"ND_disney_principled\"\n"
                                           "token outputs:surface\n}\n");
    const auto scene = read(material + bound());
    EXPECT_EQ(materialOf(*scene, "/m").baseColor, glm::vec3(1, 0, 0));
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdMaterial, OfTwoTexturesTheFirstStays) {
    const auto scene = read(shader("ND_standard_surface_surfaceshader",
                                   "color3f inputs:base_color.connect = </mat/image.outputs:out>\n"
                                   "float inputs:base.connect = </mat/weight.outputs:out>\n") +
                            bound());
    const Material& m = materialOf(*scene, "/m");
    ASSERT_NE(m.baseColorMap.texture, TextureId::None);
    EXPECT_TRUE(scene->texture(m.baseColorMap.texture).name.ends_with("tex.png"));
    EXPECT_TRUE(warned("/mat/s: the product of two textures is not supported: base is ignored")) << allWarnings();
}

TEST_F(UsdMaterial, InputsOfAnotherTypeTakeTheirDefault) {
    for (const char* bad : {"float2 inputs:diffuseColor = (1, 1)", "string inputs:diffuseColor = \"red\"",
                            "matrix4d inputs:diffuseColor = ((1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1))"}) {
        warnings_.clear();
        const Material m = preview(std::string(bad) + "\ncolor3f inputs:emissiveColor = (4, 5, 6)\n" +
                                   "color3f inputs:roughness = (1, 0, 0)\nasset inputs:ior = @a@\n");
        EXPECT_EQ(m.baseColor, glm::vec3(0.18f)) << bad;
        EXPECT_EQ(m.emission, glm::vec3(4, 5, 6));
        EXPECT_EQ(m.roughness, 0.5f);
        EXPECT_EQ(m.ior, 1.5f);
        for (const char* name : {"diffuseColor", "roughness", "ior"})
            EXPECT_TRUE(warned("/mat/s: " + std::string(name) + " is of another type")) << allWarnings();
    }
    const Material m = preview("color4f inputs:diffuseColor = (1, 0, 0, 1)\nfloat inputs:emissiveColor = 2\n");
    EXPECT_EQ(m.baseColor, glm::vec3(1, 0, 0)) << "an alpha does no harm";
    EXPECT_EQ(m.emission, glm::vec3(2)) << "a number is a grey";
}

TEST_F(UsdMaterial, BadTextureNodesCostOnlyThemselves) {
    const auto with = [](std::string_view good, std::string_view bad) {
        std::string material =
            shader("UsdPreviewSurface", "color3f inputs:diffuseColor.connect = </mat/tex.outputs:rgb>\n");
        return material.replace(material.find(good), good.size(), bad);
    };
    auto scene = read(with("float4 inputs:scale = (2, 3, 4, 5)", "float2 inputs:scale = (2, 3)") + bound());
    EXPECT_NE(materialOf(*scene, "/m").baseColorMap.texture, TextureId::None);
    EXPECT_EQ(materialOf(*scene, "/m").baseColorMap.scale, glm::vec4(1));
    EXPECT_TRUE(warned("/mat/tex: scale is of another type")) << allWarnings();
    warnings_.clear();
    scene =
        read(with("inputs:in.connect = </mat/st.outputs:result>", "inputs:in.connect = </mat/place.outputs:result>") +
             bound());
    EXPECT_EQ(scene->world.count<MeshInstance>(), 1u);
    EXPECT_EQ(materialOf(*scene, "/m").baseColor, glm::vec3(0.18f));
    EXPECT_TRUE(warned("/mat: not readable")) << allWarnings();
}

TEST_F(UsdMaterial, ValuesOutOfRangeAreBroughtIn) {
    const Material m = preview("float inputs:roughness = 7\nfloat inputs:metallic = -1\nfloat inputs:ior = 0\ncolor3f "
                               "inputs:diffuseColor = (nan, 1, 1)\n");
    EXPECT_EQ(m.roughness, 1);
    EXPECT_EQ(m.metallic, 0);
    EXPECT_EQ(m.ior, 1.5f);
    EXPECT_EQ(m.baseColor, glm::vec3(0.18f));
}

TEST_F(UsdMaterial, TexturesInsidePackages) {
    const auto stage = write(
        "packed.usda",
        "#usda 1.0\n" + shader("UsdPreviewSurface", "color3f inputs:diffuseColor.connect = </mat/tex.outputs:rgb>\n") +
            bound());
    write("tex.png", "image bytes");
    {
        ensurePython();
        py::gil_scoped_acquire lock;
        importReader();
        EXPECT_TRUE(py::module_::import("pxr.UsdUtils")
                        .attr("CreateNewUsdzPackage")(stage.string(), (folder_ / "p.usdz").string())
                        .cast<bool>());
    }
    std::string content;
    const auto scene = readStage(folder_ / "p.usdz", [&](const std::filesystem::path& file, ColorSpace) {
        std::ifstream in(file, std::ios::binary);
        content.assign(std::istreambuf_iterator<char>(in), {});
        EXPECT_EQ(file.extension(), ".png");
        return Texture{};
    });
    EXPECT_EQ(content, "image bytes");
    EXPECT_NE(scene->material(MaterialId{0}).baseColorMap.texture, TextureId::None);
}

} // namespace
} // namespace trilume::usd
