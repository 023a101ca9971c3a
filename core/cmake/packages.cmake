# Debian packages, which ./dev packages makes: groundray (programs, data, golden suite), groundray-view, and libgroundray-dev
# (static libraries and headers), with the licence of each in /usr/share/doc.
set(GROUNDRAY_LIBRARY_PACKAGES "" CACHE STRING "Debian packages that users of the libraries need, separated by commas")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the developers of groundray")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL programs libraries)
if(GROUNDRAY_VIEW)
  list(APPEND CPACK_COMPONENTS_ALL viewer)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME groundray)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SHLIBDEPS ON)
set(CPACK_COMPONENT_PROGRAMS_DESCRIPTION "${PROJECT_DESCRIPTION}")
set(CPACK_DEBIAN_VIEWER_PACKAGE_NAME groundray-view)
set(CPACK_DEBIAN_VIEWER_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_VIEWER_PACKAGE_DEPENDS "groundray (>= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_VIEWER_DESCRIPTION "Viewer of scenes, scans, images and meshes for groundray")
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_NAME libgroundray-dev)
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_DEPENDS "${GROUNDRAY_LIBRARY_PACKAGES}")
set(CPACK_COMPONENT_LIBRARIES_DESCRIPTION "Static libraries and headers of groundray, a ray tracer for lidars and cameras")

# Programs and libraries contain parts of CGAL under GPL-3.
set(copyright ${PROJECT_BINARY_DIR}/copyright)
file(READ ${PROJECT_SOURCE_DIR}/LICENSE licence)
file(CONFIGURE OUTPUT ${copyright} @ONLY CONTENT "The sources of groundray are under the Apache License 2.0, which follows.
This package also contains parts of CGAL, and as a whole is under the GNU General Public License, version 3 or later
(/usr/share/common-licenses/GPL-3). data/README.md lists the licences of included data.

@licence@")
foreach(component programs viewer libraries)
  string(TOUPPER ${component} upper)
  if(component IN_LIST CPACK_COMPONENTS_ALL)
    install(FILES ${copyright} DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME}
      COMPONENT ${component})
  endif()
endforeach()
include(CPack)
