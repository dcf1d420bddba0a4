# find_package(eft) gives the target eft::eft.
get_filename_component(_eft_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT TARGET eft::eft)
  add_library(eft::eft STATIC IMPORTED)
  set_target_properties(eft::eft PROPERTIES
    IMPORTED_LOCATION "${_eft_prefix}/lib/libeft.a"
    INTERFACE_INCLUDE_DIRECTORIES "${_eft_prefix}/include")
endif()
unset(_eft_prefix)
