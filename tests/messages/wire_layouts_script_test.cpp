// The script that generates the layouts refuses every construct of a .lcm file that the script does not know.
// If it ignored a construct, some bytes of messages would stay unchecked.
#include <gtest/gtest.h>

#include <ostream>
#include <regex>

#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

struct Result {
  int exit_code = -1;
  std::string errors;  // standard error; each sequence of blanks and line ends is replaced by one blank
  std::string tables;  // the generated header
};

Result make_layouts(const TemporaryFolder& folder, const std::string& types) {
  const std::string output = folder / "layouts.hpp";
  const Outcome outcome =
      run(std::string("'" FREEFLEX_CMAKE "' -DSOURCE_DIR='") + folder.path() + "' '-DTYPES=" + types +
          "' -DOUTPUT='" + output + "' -P '" FREEFLEX_SOURCE_DIR "/messages/wire_layouts.cmake'");
  return {outcome.exit_code, std::regex_replace(outcome.err, std::regex("\\s+"), " "), read_text(output)};
}

Result make_layout_of(const std::string& text) {
  const TemporaryFolder folder;
  write_text(folder / "a_t.lcm", text);
  return make_layouts(folder, "a_t");
}

struct Unknown {
  const char* name;
  const char* text;
  const char* error;
};
void PrintTo(const Unknown& unknown, std::ostream* out) { *out << unknown.name; }

constexpr const char* kNotOneStruct =
    "a_t.lcm: is not 'package freeflex_msgs; struct a_t { fields }' and nothing else";
const std::vector<Unknown> kUnknown = {
    {"NoPackage", "struct a_t { int32_t x; }", kNotOneStruct},
    {"OtherPackage", "package other; struct a_t { int32_t x; }", kNotOneStruct},
    {"OtherName", "package freeflex_msgs; struct b_t { int32_t x; }", kNotOneStruct},
    {"Enum", "package freeflex_msgs; enum a_t { X, Y }", kNotOneStruct},
    {"NoFields", "package freeflex_msgs; struct a_t { }", kNotOneStruct},
    {"NoSemicolon", "package freeflex_msgs; struct a_t { int32_t x; int32_t y }", kNotOneStruct},
    {"TwoStructs", "package freeflex_msgs; struct a_t { int32_t x; } struct b_t { int32_t y; }",
     "'} struct b_t { int32_t y' is neither TYPE NAME, TYPE NAME[SIZE] nor a constant"},
    {"TwoNames", "package freeflex_msgs; struct a_t { int32_t x, y; }",
     "'int32_t x, y' is neither TYPE NAME, TYPE NAME[SIZE] nor a constant"},
    {"Constants", "package freeflex_msgs; struct a_t { const int32_t X = 1; }", "has no field"},
    {"ConstantOfAString", "package freeflex_msgs; struct a_t { const string X = 1; int32_t x; }",
     "'const string X = 1' is neither TYPE NAME"},
    {"UnknownType", "package freeflex_msgs; struct a_t { uint32_t x; }",
     "'uint32_t x': the type is neither one of LCM's nor one of the project's"},
    {"TypeOfAnotherPackage", "package freeflex_msgs; struct a_t { other.b_t x; }",
     "'other.b_t x' is neither TYPE NAME"},
    {"CountAfter", "package freeflex_msgs; struct a_t { double x[n]; int32_t n; }",
     "'x': the dimension 'n' is neither 1 to 999 nor an int32_t before it"},
    {"CountOf64Bits", "package freeflex_msgs; struct a_t { int64_t n; double x[n]; }",
     "'x': the dimension 'n' is neither 1 to 999 nor an int32_t before it"},
    {"CountThatIsAnArray", "package freeflex_msgs; struct a_t { int32_t n[2]; double x[n]; }",
     "'x': the dimension 'n' is neither 1 to 999 nor an int32_t before it"},
    {"NoElements", "package freeflex_msgs; struct a_t { double x[0]; }",
     "the dimension '0' is neither 1 to 999"},
    {"TooManyElements", "package freeflex_msgs; struct a_t { double x[1000]; }",
     "the dimension '1000' is neither"},
    {"ThreeDimensions", "package freeflex_msgs; struct a_t { double x[2][2][2]; }",
     "'x': more than two dimensions"},
    {"TwoCounts", "package freeflex_msgs; struct a_t { int32_t n; double x[n][n]; }",
     "more than one that is not constant"},
    {"EmptyBrackets", "package freeflex_msgs; struct a_t { double x[]; }",
     "'double x[]' is neither TYPE NAME"},
    {"AngleBrackets", "package freeflex_msgs; struct a_t { double x<3>; }", "'<' is not known"},
    {"Itself", "package freeflex_msgs; struct a_t { int32_t n; a_t x[n]; }",
     "structs that contain themselves or each other: a_t"},
};

class UnknownConstruct : public ::testing::TestWithParam<Unknown> {};
INSTANTIATE_TEST_SUITE_P(LayoutScript, UnknownConstruct, ::testing::ValuesIn(kUnknown),
                         [](const auto& at) { return std::string(at.param.name); });

TEST_P(UnknownConstruct, TheScriptStopsAtAnUnknownConstructAndReportsIt) {
  const Result result = make_layout_of(GetParam().text);
  EXPECT_NE(result.exit_code, 0);
  EXPECT_TRUE(contains(result.errors, GetParam().error)) << result.errors;
  EXPECT_EQ(result.tables, "");
}

TEST(LayoutScript, IgnoresNothingButCommentsConstantsAndBlanks) {
  const Result result = make_layout_of(
      "// before\npackage freeflex_msgs ;\n/* one // in the other\n */ struct a_t\n{\n  int32_t n; // /* not "
      "begun\n"
      "  const int32_t A = 1, B=-2;  /* ; */\n  double x [ n ][ 3 ];  // */\n  boolean b;\n}\n");
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  for (const char* row :
       {"{\"n\", Kind::kInt32, nullptr, true, 0, {{}}}", "{\"b\", Kind::kBoolean, nullptr, false, 0, {{}}}",
        "{\"x\", Kind::kDouble, nullptr, false, 2, {{counted_by(0), constant(3)}}}"})
    EXPECT_TRUE(contains(result.tables, row)) << row << result.tables;
}

TEST(LayoutScript, PutsEachStructAfterItsNestedStructs) {
  const TemporaryFolder folder;
  write_text(folder / "a_t.lcm", "package freeflex_msgs; struct a_t { b_t b; c_t c; }");
  write_text(folder / "b_t.lcm", "package freeflex_msgs; struct b_t { c_t c[2]; }");
  write_text(folder / "c_t.lcm",
             "package freeflex_msgs; struct c_t { int32_t n; int32_t m; byte y[m]; byte z[n]; }");
  const Result result = make_layouts(folder, "a_t;b_t;c_t");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto position = [&result](const char* text) { return result.tables.find(text); };
  EXPECT_LT(position("Layout c_t ="), position("Layout b_t ="));
  EXPECT_LT(position("Layout b_t ="), position("Layout a_t ="));
  EXPECT_TRUE(contains(result.tables, "{\"y\", Kind::kByte, nullptr, false, 1, {{counted_by(1)}}}"))
      << "counts are numbered in the order in which they are declared, not in the order in which they are "
         "used";
}

}  // namespace
}  // namespace freeflex::testing
