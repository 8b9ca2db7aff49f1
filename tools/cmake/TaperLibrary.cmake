# Taper for other people's firmware: one archive of all layers and ports, as target taper::taper, as an installed package
# for find_package(taper), and for pkg-config.

get_property(core_libraries GLOBAL PROPERTY TAPER_CORE_LIBRARIES)
get_property(header_folders GLOBAL PROPERTY TAPER_HEADER_FOLDERS)
if(TARGET taper_socketcan)
    list(APPEND core_libraries taper_socketcan)
endif()
foreach(library IN LISTS core_libraries)
    list(APPEND objects $<TARGET_OBJECTS:${library}>)
endforeach()

add_library(taper STATIC ${objects})
add_library(taper::taper ALIAS taper)
set_target_properties(taper PROPERTIES LINKER_LANGUAGE C)
target_compile_features(taper PUBLIC c_std_11)
target_include_directories(taper INTERFACE "$<BUILD_INTERFACE:${header_folders}>")
target_link_libraries(taper PUBLIC m)

# As taper-config.cmake has them too.
set(taper_REAL ${TAPER_REAL} CACHE INTERNAL "Floating-point type of the planner")
set(taper_STATIONS ${TAPER_STATIONS} CACHE INTERNAL "Stations of the library")
set(taper_WITH_PLANNER ${TAPER_WITH_PLANNER} CACHE INTERNAL "Whether the library has a planner")
set(taper_TEMPLATE_DIR ${PROJECT_SOURCE_DIR}/firmware/port/template CACHE INTERNAL "Fill-in start of a port")

if(NOT TAPER_INSTALL)
    return()
endif()

include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/taper)
set(template_dir ${CMAKE_INSTALL_DATADIR}/taper/template)

install(TARGETS taper EXPORT taper COMPONENT library INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
foreach(folder IN LISTS header_folders)
    install(DIRECTORY ${folder}/taper DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT library)
endforeach()
install(DIRECTORY ${taper_TEMPLATE_DIR}/ DESTINATION ${template_dir} COMPONENT library)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/taper COMPONENT library)

install(EXPORT taper NAMESPACE taper:: FILE taper-targets.cmake DESTINATION ${package_dir} COMPONENT library)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/taper-config.cmake.in ${PROJECT_BINARY_DIR}/taper-config.cmake
    INSTALL_DESTINATION ${package_dir} PATH_VARS template_dir)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/taper-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/taper-config.cmake ${PROJECT_BINARY_DIR}/taper-config-version.cmake
    DESTINATION ${package_dir} COMPONENT library)

file(RELATIVE_PATH to_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
string(REGEX REPLACE "/$" "" to_prefix "${to_prefix}")
configure_file(${CMAKE_CURRENT_LIST_DIR}/taper.pc.in ${PROJECT_BINARY_DIR}/taper.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/taper.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT library)
