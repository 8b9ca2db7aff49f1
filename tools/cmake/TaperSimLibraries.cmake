# libcsv and cJSON for the simulation: the targets taper_csv and taper_cjson. On the host they are the system's; where it
# is cross-compiled they are built from the sources in build/deps (tools/fetch_sources), so no package of the target is
# needed.

set(TAPER_DEPS_DIR ${PROJECT_SOURCE_DIR}/build/deps CACHE PATH "Folder with csv/ and cjson/, for cross-compiled simulations")

# taper_library_from_source(NAME SOURCE INCLUDE_DIR): foreign code, without our warnings.
function(taper_library_from_source name source include_dir)
    if(NOT EXISTS ${source})
        message(FATAL_ERROR "the simulation needs ${source}: run tools/fetch_sources, or configure with -DTAPER_BUILD_SIM=OFF")
    endif()
    add_library(${name} STATIC ${source})
    target_include_directories(${name} SYSTEM PUBLIC ${include_dir})
endfunction()

# taper_library_of_system(NAME HEADER LIBRARY PACKAGE)
function(taper_library_of_system name header library package)
    find_path(${name}_INCLUDE_DIR ${header})
    find_library(${name}_LIBRARY ${library})
    if(NOT ${name}_INCLUDE_DIR OR NOT ${name}_LIBRARY)
        message(FATAL_ERROR "the simulation needs ${header} and lib${library}. Debian: apt-get install ${package}")
    endif()
    add_library(${name} INTERFACE)
    target_include_directories(${name} SYSTEM INTERFACE ${${name}_INCLUDE_DIR})
    target_link_libraries(${name} INTERFACE ${${name}_LIBRARY})
endfunction()

if(CMAKE_CROSSCOMPILING)
    taper_library_from_source(taper_csv ${TAPER_DEPS_DIR}/csv/libcsv.c ${TAPER_DEPS_DIR}/csv)
    taper_library_from_source(taper_cjson ${TAPER_DEPS_DIR}/cjson/cJSON.c ${TAPER_DEPS_DIR})
    target_link_libraries(taper_cjson PRIVATE m)
else()
    taper_library_of_system(taper_csv csv.h csv libcsv-dev)
    taper_library_of_system(taper_cjson cjson/cJSON.h cjson libcjson-dev)
endif()
