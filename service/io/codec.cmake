target_sources(freeflex_io PRIVATE codec.cpp codec_rules.cpp codec_wire.cpp outbound.cpp outbound_scene.cpp reason.cpp)
