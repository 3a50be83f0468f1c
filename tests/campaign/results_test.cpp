// Files of results, shards and shrinking.
#include "tools/campaign/results.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <string>

#include "tests/scene/temporary_folder.hpp"
#include "tools/campaign/columns.hpp"
#include "tools/campaign/shard.hpp"
#include "tools/campaign/shrink.hpp"

namespace freeflex::campaign {
namespace {

using testing::TemporaryFolder;

const std::string kStamp = "# stamp";

std::string write_rows(const std::vector<std::string>& rows, const Shard& shard = {}) {
  PartFile part;
  EXPECT_EQ(part.create("out", kStamp, shard), "");
  for (const std::string& row : rows) EXPECT_EQ(part.append({row, 0.25, 1.5}), "");
  return part.path();
}

TEST(ResultFiles, GiveBackWhatWasAppended) {
  const TemporaryFolder folder;
  write_rows({"2,passed,1.5,", "0,failed,,\"why, exactly\""});
  write_rows({"1,passed,,"});
  const Results results = read_results("out", kStamp);
  EXPECT_EQ(results.error, "");
  EXPECT_EQ(results.num_files, 2);
  ASSERT_EQ(results.rows.size(), 3u);
  EXPECT_EQ(results.rows.at(0).row, "0,failed,,\"why, exactly\"");
  EXPECT_EQ(results.rows.at(2).setup_seconds, 0.25);
  EXPECT_EQ(results.rows.at(2).run_seconds, 1.5);
}

TEST(ResultFiles, MayBeCutAtAnyByte) {
  const TemporaryFolder folder;
  const std::string path = write_rows({"0,passed,", "1,passed,", "2,passed,"});
  const auto size = std::filesystem::file_size(path);
  std::size_t last = 4;
  for (auto cut = size; cut > 0; --cut) {
    std::filesystem::resize_file(path, cut);
    const Results results = read_results("out", kStamp);
    ASSERT_EQ(results.error, "") << cut;
    ASSERT_LE(results.rows.size(), last) << cut;
    ASSERT_GE(results.rows.size() + 1, last == 4 ? 4 : last) << "one byte may cost one row only";
    last = results.rows.size();
    for (const auto& [number, stored] : results.rows)
      ASSERT_EQ(stored.row, std::to_string(number) + ",passed,");
  }
}

TEST(ResultFiles, OfAnotherCampaignAreRefused) {
  const TemporaryFolder folder;
  write_rows({"0,passed,"});
  EXPECT_NE(read_results("out", "# other").error.find("belongs to another campaign"), std::string::npos);
}

TEST(ResultFiles, TwoResultsOfOneCaseMustBeEqual) {
  const TemporaryFolder folder;
  write_rows({"0,passed,", "1,crashed,", "2,passed,1"});
  write_rows({"0,passed,", "1,passed,", "3,hung,"});
  EXPECT_EQ(read_results("out", kStamp).error, "");
  EXPECT_EQ(read_results("out", kStamp).rows.at(1).row, "1,passed,") << "a lost case gives way";
  EXPECT_EQ(read_results("out", kStamp).num_retried, 1);
  write_rows({"2,passed,2"});
  EXPECT_NE(read_results("out", kStamp).error.find("case 2 has two results that differ"), std::string::npos);
}

TEST(ResultFiles, AShardReadsThoseThatMayHaveItsCases) {
  const TemporaryFolder folder;
  write_rows({"0,passed,"}, {0, 2});
  write_rows({"1,passed,"}, {1, 2});
  write_rows({"2,passed,"}, {2, 3});
  const Results results = read_results("out", kStamp, Shard{1, 2});
  EXPECT_EQ(results.num_files, 2);
  EXPECT_TRUE(results.rows.contains(1) && results.rows.contains(2) && !results.rows.contains(0));
}

std::string shard_text(const std::string& text, const std::map<std::string, std::string>& variables = {}) {
  std::string error;
  const auto shard = parse_shard(
      text,
      [&](const char* name) {
        const auto found = variables.find(name);
        return found == variables.end() ? nullptr : found->second.c_str();
      },
      error);
  return shard ? std::to_string(shard->index) + "/" + std::to_string(shard->count) : error;
}

TEST(Shards, AreThoseOfTheTask) {
  EXPECT_EQ(shard_text("3/7"), "3/7");
  EXPECT_EQ(shard_text("auto", {{"SLURM_ARRAY_TASK_ID", "12"},
                                {"SLURM_ARRAY_TASK_MIN", "10"},
                                {"SLURM_ARRAY_TASK_COUNT", "5"}}),
            "2/5");
  // a task that is submitted again, alone, keeps its number
  EXPECT_EQ(shard_text("auto/20", {{"SLURM_ARRAY_TASK_ID", "7"}, {"SLURM_ARRAY_TASK_MIN", "7"}}), "7/20");
  EXPECT_EQ(shard_text("auto/4", {{"JOB_COMPLETION_INDEX", "3"}}), "3/4");
  EXPECT_EQ(shard_text("auto", {{"OMPI_COMM_WORLD_RANK", "0"}, {"OMPI_COMM_WORLD_SIZE", "2"}}), "0/2");
  EXPECT_EQ(shard_text("7/7"), "K is 7 and N is 7, but K must be from 0 to N - 1; write K/N");
  EXPECT_EQ(shard_text("auto"),
            "auto needs one of the variables SLURM_ARRAY_TASK_ID, JOB_COMPLETION_INDEX and "
            "OMPI_COMM_WORLD_RANK, but "
            "none is set; write K/N");
  EXPECT_EQ(shard_text("1.5/2"),
            "the value is '1.5/2', but must be K/N with K from 0 to N - 1, auto or auto/N");
}

TEST(Shrinking, FindsTheOnlyValueThatMattersAndHowFarItMustGo) {
  Campaign campaign;
  std::vector<std::string> values;
  for (int k = 0; k < 6; ++k) {
    campaign.variables.push_back({"v" + std::to_string(k), {"rate"}, "0"});
    campaign.sampling.variables.push_back(Uniform{-1.0, 1.0});
    values.push_back("0.8");
  }
  // fails if v3 is above 0.5, whatever the others are
  Shrinking shrinking(campaign, values);
  while (const auto trial = shrinking.next()) shrinking.take(std::stod((*trial)[3]) > 0.5);
  EXPECT_EQ(shrinking.remaining(), std::vector<std::size_t>{3});
  EXPECT_GT(std::stod(shrinking.values()[3]), 0.5);
  EXPECT_LT(std::stod(shrinking.values()[3]), 0.501);
  EXPECT_LT(shrinking.num_trials(), 30);
}

TEST(Shrinking, KeepsTwoValuesThatFailTogetherOnly) {
  Campaign campaign;
  std::vector<std::string> values{"1", "1", "1"};
  for (int k = 0; k < 3; ++k) {
    campaign.variables.push_back({"v", {"rate"}, "0"});
    campaign.sampling.variables.push_back(Uniform{-1.0, 1.0});
  }
  Shrinking shrinking(campaign, values);
  while (const auto trial = shrinking.next())
    shrinking.take(std::stod((*trial)[0]) + std::stod((*trial)[2]) > 1.5);
  EXPECT_EQ(shrinking.remaining(), (std::vector<std::size_t>{0, 2}));
  EXPECT_NEAR(std::stod(shrinking.values()[0]), 0.75, 1e-3);
}

TEST(ColumnStatistics, AreThoseOfSmallTables) {
  const Column rising{"a", {1, 2, 3, 4}}, falling{"b", {8, 4, 2, 1}};
  EXPECT_DOUBLE_EQ(rank_correlation(rising, rising), 1.0);
  EXPECT_DOUBLE_EQ(rank_correlation(rising, falling), -1.0);
  EXPECT_EQ(separation(rising, {false, false, true, true}), 1.0);
  EXPECT_EQ(separation(rising, {true, false, true, false}), 0.5);
  EXPECT_EQ(quantile_of({1, 2, 3, 4}, 0.5), 2.5);
  // infinite values are the largest ones, and what is no number does not count
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const Column late{"c", {3, kInfinite, kInfinite, std::nan("")}};
  EXPECT_EQ(quantile_of(sorted_values(late), 0.5), kInfinite);
  EXPECT_GT(rank_correlation(rising, late), 0.8);
}

TEST(ColumnStatistics, OfListsOfNumbersAreThoseOfTheNumbers) {
  Campaign campaign;
  campaign.variables = {{"k", {"a"}, "5"}, {"f", {"b"}, "x"}};
  campaign.sampling.variables = {Choice{{"5", "2"}}, Choice{{"x", "y"}}};
  Results results;
  results.rows[0] = {"0,passed,2,y,", 0.0, 0.0};
  const Columns columns = columns_of(campaign, results);
  EXPECT_EQ(columns.variables[0].values[0], 2.0);
  EXPECT_EQ(columns.variables[1].name, "f (place in its list)");
  EXPECT_EQ(columns.variables[1].values[0], 2.0);
}

}  // namespace
}  // namespace freeflex::campaign
