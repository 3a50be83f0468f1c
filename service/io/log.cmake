target_sources(freeflex_io PRIVATE log.cpp)
