# Runs codegen at configure time, when an input changed, into <build of Taper>/generated: ${TAPER_GENERATED}.

find_program(TAPER_PYTHON NAMES python3 HINTS ${PROJECT_SOURCE_DIR}/build/venv/bin NO_DEFAULT_PATH NO_CACHE)
if(NOT TAPER_PYTHON)
    find_program(TAPER_PYTHON NAMES python3 NO_CACHE REQUIRED)
endif()

set(TAPER_GENERATED ${PROJECT_BINARY_DIR}/generated)

file(GLOB TAPER_CODEGEN_INPUTS CONFIGURE_DEPENDS
    ${PROJECT_SOURCE_DIR}/codegen/*.py ${PROJECT_SOURCE_DIR}/codegen/*.toml ${TAPER_STATION_DIR}/*.toml)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${TAPER_CODEGEN_INPUTS})

function(taper_generate)
    list(JOIN TAPER_STATIONS "," stations)
    set(arguments --stations ${stations} --station-dir ${TAPER_STATION_DIR} --real ${TAPER_REAL})
    if(NOT TAPER_WITH_PLANNER)
        list(APPEND arguments --no-planner)
    endif()
    set(key "${arguments}")
    foreach(input IN LISTS TAPER_CODEGEN_INPUTS)
        file(SHA256 ${input} hash)
        string(APPEND key " ${input} ${hash}")
    endforeach()
    set(stamp ${PROJECT_BINARY_DIR}/generated.stamp)
    set(made "")
    if(EXISTS ${stamp})
        file(READ ${stamp} made)
    endif()
    if(made STREQUAL key)
        return()
    endif()
    message(STATUS "Generating stations ${stations} (${TAPER_REAL})")
    execute_process(
        COMMAND ${TAPER_PYTHON} ${PROJECT_SOURCE_DIR}/codegen/generate.py ${arguments} --out ${TAPER_GENERATED}
        WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
        RESULT_VARIABLE result OUTPUT_VARIABLE account ERROR_VARIABLE reason)
    if(NOT result EQUAL 0)
        message(FATAL_ERROR "codegen failed:\n${reason}\n"
            "If a Python package is missing: tools/dev setup makes build/venv with all of them.")
    endif()
    message(STATUS "Memory of the stations:\n${account}")
    file(WRITE ${stamp} "${key}")
endfunction()

taper_generate()
