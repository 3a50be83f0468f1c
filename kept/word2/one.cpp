#include <gtest/gtest.h>
#include "tests/motion/word_truth.hpp"
using namespace freeflex::testing;
TEST(One,seed){WordCounts c;for(const char*p=getenv("SEEDS");p&&*p;){char*e;judge_scene(strtoull(p,&e,10),c);p=*e?e+1:e;}}
