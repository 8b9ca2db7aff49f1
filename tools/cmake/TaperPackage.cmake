# The Debian package taper-station, of what is installed as component `station` (firmware/linux): `cmake --build --preset
# PRESET -t package` leaves taper-station_VERSION_ARCHITECTURE.deb in the build folder. Needs dpkg-deb, and dpkg-shlibdeps
# for a program that uses the distribution's libraries.

set(TAPER_MAINTAINER "The Taper authors <taper@localhost>" CACHE STRING "Maintainer of the package, who hands it out: name and address")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME taper-station)
set(CPACK_PACKAGE_VENDOR Taper)
set(CPACK_PACKAGE_CONTACT ${TAPER_MAINTAINER})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "controller of an EV charging station on CAN")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
    "Plans the current of every connector from the vehicles' state of charge, and\nnever exceeds a limit. Runs as a service on SocketCAN; /etc/taper/station.env\nhas the settings of the site.")
set(CPACK_DEBIAN_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "can-utils, iproute2")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)

# One package, of this component alone; its paths are absolute, and its unit names the program in /usr.
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL station station_package)
set(CPACK_COMPONENTS_GROUPING ALL_COMPONENTS_IN_ONE)
set(CPACK_SET_DESTDIR ON)
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(debian_dir ${PROJECT_SOURCE_DIR}/firmware/linux/debian)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
    ${debian_dir}/conffiles ${debian_dir}/postinst ${debian_dir}/prerm ${debian_dir}/postrm)

# A host build has the architecture of the machine: CPack asks dpkg.
if(CMAKE_CROSSCOMPILING)
    set(debian_names x86_64 amd64 aarch64 arm64 armv7l armhf riscv64 riscv64)
    list(FIND debian_names "${CMAKE_SYSTEM_PROCESSOR}" at)
    if(at GREATER_EQUAL 0)
        math(EXPR at "${at} + 1")
        list(GET debian_names ${at} CPACK_DEBIAN_PACKAGE_ARCHITECTURE)
    endif()
endif()

# What the program is linked with tells what the package depends on; another architecture's libraries are the compiler's.
if(NOT TAPER_STATIC)
    set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
    if(CMAKE_CROSSCOMPILING)
        execute_process(COMMAND ${CMAKE_C_COMPILER} -print-file-name=libc.so.6
            OUTPUT_VARIABLE libc OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
        cmake_path(GET libc PARENT_PATH CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS)
    endif()
endif()

include(CPack)

# `package` would build the tests first.
add_custom_target(deb COMMAND ${CMAKE_CPACK_COMMAND} DEPENDS taper-station COMMENT "Debian package" VERBATIM)
