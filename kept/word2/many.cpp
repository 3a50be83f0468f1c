#include <gtest/gtest.h>
#include "tests/motion/word_truth.hpp"
using namespace freeflex::testing;
TEST(Many,seeds){WordCounts c;auto a=strtoull(getenv("FROM"),0,10);int n=atoi(getenv("N"));for(int k=0;k<n;++k)judge_scene(a+k,c);expect_true_words(c);}
