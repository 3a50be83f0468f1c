# the bus's address, for the daemon and the command line
add_library(freeflex_lcm_url STATIC lcm_url.cpp)
target_link_libraries(freeflex_lcm_url PUBLIC freeflex_options)

# the process that receives commands, and the daemon's side of it
add_library(freeflex_ingress STATIC ingress.cpp ingress_inlet.cpp ingress_process.cpp)
target_link_libraries(freeflex_ingress PUBLIC freeflex_io freeflex_lcm_url freeflex_messages PRIVATE Threads::Threads)
