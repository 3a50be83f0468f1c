# the process that receives commands, and the daemon's side of it
add_library(freeflex_ingress STATIC ingress.cpp ingress_inlet.cpp ingress_process.cpp lcm_url.cpp)
target_link_libraries(freeflex_ingress PUBLIC freeflex_io freeflex_messages PRIVATE Threads::Threads)
