# How Taper's own code is compiled, and how a firmware layer becomes a library.

set(CMAKE_C_STANDARD 11)
set(CMAKE_C_STANDARD_REQUIRED ON)
set(CMAKE_C_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

# Float results equal to the bit on every target need every multiplication and addition to round on its own.
add_compile_options(-ffp-contract=off)

if(TAPER_FUZZ)
    if(NOT CMAKE_C_COMPILER_ID MATCHES "Clang")
        message(FATAL_ERROR "TAPER_FUZZ needs clang and its libFuzzer: configure with CC=clang (tests/fuzz/README.md)")
    endif()
    set(TAPER_SANITIZE ON)
    add_compile_options(-fsanitize=fuzzer-no-link)
    add_link_options(-fsanitize=fuzzer-no-link)
endif()

if(TAPER_SANITIZE)
    add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
    add_link_options(-fsanitize=address,undefined)
endif()

# 32-bit Linux: dates after 2038, recordings of more than 2 GB, and files with large inode numbers.
if(CMAKE_SYSTEM_NAME STREQUAL Linux AND CMAKE_SIZEOF_VOID_P EQUAL 4)
    add_compile_definitions(_FILE_OFFSET_BITS=64 _TIME_BITS=64)
endif()

if(TAPER_STATIC)
    string(APPEND CMAKE_EXE_LINKER_FLAGS " -static")
endif()

# Our own code: every warning is an error. Generated and foreign code does not link this.
add_library(taper_strict INTERFACE)
target_compile_options(taper_strict INTERFACE
    -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wdouble-promotion -Wvla -Werror)

# Layers without floating point are compiled so that using it is an error, where the compiler can say so.
include(CheckCCompilerFlag)
check_c_compiler_flag(-mgeneral-regs-only TAPER_CAN_FORBID_FLOAT)

# taper_layer(NAME [FLOAT] SOURCES ... DEPENDS ...): firmware/NAME as library taper_NAME with its own include folder. A
# layer sees the headers of what it depends on and no others, so an upward include does not compile. Without FLOAT it
# may not use floating point.
function(taper_layer name)
    cmake_parse_arguments(LAYER "FLOAT" "" "SOURCES;DEPENDS" ${ARGN})
    add_library(taper_${name} STATIC ${LAYER_SOURCES})
    target_include_directories(taper_${name} PUBLIC include)
    taper_headers(${CMAKE_CURRENT_SOURCE_DIR}/include)
    list(TRANSFORM LAYER_DEPENDS PREPEND taper_)
    target_link_libraries(taper_${name} PUBLIC ${LAYER_DEPENDS} PRIVATE taper_strict)
    if(TAPER_CAN_FORBID_FLOAT AND NOT LAYER_FLOAT)
        target_compile_options(taper_${name} PRIVATE -mgeneral-regs-only)
    endif()
    taper_is_core(taper_${name})
endfunction()

# taper_is_core(LIBRARY): it goes into images, and into libtaper.a; the tests look into it from outside.
function(taper_is_core library)
    set_property(GLOBAL APPEND PROPERTY TAPER_CORE_LIBRARIES ${library})
endfunction()

# taper_headers(FOLDER): its taper/*.h are for who uses Taper.
function(taper_headers folder)
    set_property(GLOBAL APPEND PROPERTY TAPER_HEADER_FOLDERS ${folder})
endfunction()
