#include "drv.hpp"
TEST(A,b){ printf("hi\n");}
