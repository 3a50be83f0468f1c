target_sources(freeflex_io PRIVATE placeholder.cpp)
