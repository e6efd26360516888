#include "errors.h"
#include "params/params.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

namespace trilume {
namespace {

ParamTable makeTable() {
    ParamTable table;
    table.add({.name = "pathtrace.nee", .defaultValue = true, .cost = ParamCost::Specialization});
    table.add(
        {.name = "pathtrace.maxDepth", .defaultValue = int64_t{8}, .minimum = 1, .maximum = 64, .unit = "bounces"});
    table.add({.name = "post.exposure", .defaultValue = 0.5, .minimum = -10, .maximum = 10, .resetsHistory = true});
    table.add({.name = "light.selection",
               .defaultValue = std::string("power"),
               .choices = {"power", "uniform"},
               .cost = ParamCost::Structural});
    return table;
}

using test::messageOf;

class ParamSetTest : public testing::Test {
protected:
    ParamTable table = makeTable();
    ParamSet set{table};
};

TEST_F(ParamSetTest, DefaultsThenTechniqueThenExplicit) {
    EXPECT_EQ(set.getInt("pathtrace.maxDepth"), 8);
    set.setDefault("pathtrace.maxDepth", "4");
    EXPECT_EQ(set.getInt("pathtrace.maxDepth"), 4);
    set.set("pathtrace.maxDepth", "16");
    set.setDefault("pathtrace.maxDepth", "5");
    EXPECT_EQ(set.getInt("pathtrace.maxDepth"), 16);
    set.clearDefaults();
    EXPECT_EQ(set.getInt("pathtrace.maxDepth"), 16);
}

TEST_F(ParamSetTest, EffortLowersWhatMayBeLowered) {
    table.add({.name = "a.rays", .defaultValue = int64_t{1024}, .minimum = 1, .maximum = 1e6, .least = 16});
    table.add({.name = "a.share", .defaultValue = 0.5, .minimum = 0, .maximum = 1, .least = 0.125});
    EXPECT_NEAR(set.effortRange(), std::log(64), 1e-12);
    uint64_t seen = set.revision();
    const auto changes = [&] { return set.revision() - std::exchange(seen, set.revision()); };
    set.setEffort(0.5);
    EXPECT_EQ(changes(), 2u);
    EXPECT_EQ(set.getInt("a.rays"), 128);
    EXPECT_DOUBLE_EQ(set.getFloat("a.share"), 0.25);
    EXPECT_EQ(set.getText("a.rays"), "1024") << "as it was set";
    EXPECT_EQ(set.getInt("pathtrace.maxDepth"), 8);
    set.setEffort(0.5);
    EXPECT_EQ(changes(), 0u);

    set.set("a.rays", "4096");
    EXPECT_EQ(set.getInt("a.rays"), 256);
    set.set("a.rays", "8"); // whoever sets less gets less
    EXPECT_EQ(set.getInt("a.rays"), 8);
    set.setDefault("a.share", "1");
    set.setEffort(0);
    EXPECT_DOUBLE_EQ(set.getFloat("a.share"), 0.125);
    set.setEffort(1);
    EXPECT_EQ(set.getInt("a.rays"), 8);
    EXPECT_DOUBLE_EQ(set.getFloat("a.share"), 1);
    EXPECT_EQ(set.historyRevision(), 0u);

    EXPECT_THROW(table.add({.name = "b", .defaultValue = 1.0, .maximum = 1, .resetsHistory = true, .least = 0.5}),
                 Error);
    EXPECT_THROW(table.add({.name = "c", .defaultValue = 1.0, .minimum = 0.5, .maximum = 1, .least = 0.25}), Error);
}

TEST_F(ParamSetTest, EveryTypeReadsWhatItPrints) {
    for (const ParamRow& row : table.rows()) {
        const std::string text = set.getText(row.name);
        set.set(row.name, text);
        EXPECT_EQ(set.getText(row.name), text);
    }
    for (const char* yes : {"1", "true", "on", "yes"}) {
        set.set("pathtrace.nee", "0");
        set.set("pathtrace.nee", yes);
        EXPECT_TRUE(set.getBool("pathtrace.nee")) << yes;
    }
    set.set("post.exposure", "+1.5e0");
    EXPECT_EQ(set.getFloat("post.exposure"), 1.5);
    set.set("light.selection", "uniform");
    EXPECT_EQ(set.getChoice("light.selection"), "uniform");
}

TEST_F(ParamSetTest, BadValuesNameTheRangeOrTheChoices) {
    const auto message = [&](const char* name, const char* text) { return messageOf([&] { set.set(name, text); }); };
    EXPECT_EQ(message("pathtrace.maxDepth", "0"),
              "bad value for parameter: pathtrace.maxDepth=0: give a whole number from 1 to 64 bounces");
    EXPECT_EQ(message("light.selection", "best"),
              "bad value for parameter: light.selection=best: give one of: power, uniform");
    for (const char* bad : {"", "abc", "1.5", "65", "9999999999999999999999"})
        EXPECT_NE(message("pathtrace.maxDepth", bad).find("from 1 to 64"), std::string::npos) << bad;
    for (const char* bad : {"nan", "inf", "-10.5", "1 2", ""})
        EXPECT_NE(message("post.exposure", bad).find("from -10 to 10"), std::string::npos) << bad;
    EXPECT_NE(message("pathtrace.nee", "2").find("0 or 1"), std::string::npos);
    EXPECT_EQ(set.revision(), 0u) << "a rejected value changes nothing";
}

TEST_F(ParamSetTest, UnknownNameSuggestsTheNearest) {
    EXPECT_EQ(messageOf([&] { set.set("pathtrace.maxdepht", "3"); }),
              "unknown parameter: pathtrace.maxdepht: did you mean pathtrace.maxDepth?");
    EXPECT_EQ(messageOf([&] { set.set("bloom", "3"); }),
              "unknown parameter: bloom: `trilume info` lists the parameters");
}

TEST_F(ParamSetTest, RevisionsCountEffectiveChanges) {
    set.set("pathtrace.maxDepth", "8"); // As it was.
    EXPECT_EQ(set.revision(), 0u);
    set.set("pathtrace.maxDepth", "9");
    EXPECT_EQ(set.revision(), 1u);
    EXPECT_EQ(set.structuralRevision(), 0u);
    set.setDefault("pathtrace.maxDepth", "3"); // Hidden by the explicit value.
    EXPECT_EQ(set.revision(), 1u);
    set.set("light.selection", "uniform");
    EXPECT_EQ(set.structuralRevision(), 1u);
    EXPECT_EQ(set.historyRevision(), 0u);
    set.setDefault("post.exposure", "1");
    EXPECT_EQ(set.historyRevision(), 1u);
    set.clearDefaults();
    EXPECT_EQ(set.historyRevision(), 2u);
    EXPECT_EQ(set.getFloat("post.exposure"), 0.5);
}

TEST_F(ParamSetTest, ReadingByAnotherTypeIsAnError) { EXPECT_THROW(set.getInt("post.exposure"), Error); }

TEST(ParamTable, RejectsDuplicatesAndBadDefaults) {
    ParamTable table = makeTable();
    EXPECT_THROW(table.add({.name = "pathtrace.nee", .defaultValue = false}), Error);
    EXPECT_THROW(table.add({.name = "a.b", .defaultValue = 2.0, .minimum = 0, .maximum = 1}), Error);
    EXPECT_THROW(table.add({.name = "a.c", .defaultValue = std::string("x"), .choices = {"y"}}), Error);
    EXPECT_EQ(table.rows().size(), 4u);
}

} // namespace
} // namespace trilume
