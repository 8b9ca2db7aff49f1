# Unity, the test framework: from build/deps/unity (tools/fetch_sources takes it out of Debian's source package cjson),
# otherwise from its maintainers' repository. The same pinned version either way; never committed.

set(TAPER_UNITY_DIR ${PROJECT_SOURCE_DIR}/build/deps/unity CACHE PATH "Folder that holds unity.c, unity.h and unity_internals.h")
set(unity_dir ${TAPER_UNITY_DIR})
if(NOT EXISTS ${unity_dir}/unity.c)
    message(STATUS "No Unity in ${unity_dir} (tools/fetch_sources puts it there): fetching it from its repository")
    include(FetchContent)
    FetchContent_Declare(unity GIT_REPOSITORY https://github.com/ThrowTheSwitch/Unity.git GIT_TAG v2.4.3 GIT_SHALLOW ON)
    FetchContent_GetProperties(unity)
    if(NOT unity_POPULATED)
        FetchContent_Populate(unity)
    endif()
    set(unity_dir ${unity_SOURCE_DIR}/src)
endif()

add_library(unity STATIC ${unity_dir}/unity.c)
target_include_directories(unity SYSTEM PUBLIC ${unity_dir})
target_compile_definitions(unity PUBLIC UNITY_SUPPORT_64 UNITY_INCLUDE_DOUBLE)
