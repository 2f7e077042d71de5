// tinygltf as we build it: only the reader of glTF's JSON structure. It opens no file, decodes no image and decodes no
// Draco data: its own Draco support indexes buffers with unchecked numbers of the file, so gltf_draco.h does that.
// The implementation is compiled once, in tinygltf.cpp; Debian's library is built with files and images.
#pragma once

#define TINYGLTF_NO_FS
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_INCLUDE_JSON
#define TINYGLTF_NO_INCLUDE_STB_IMAGE
#define TINYGLTF_NO_INCLUDE_STB_IMAGE_WRITE

#include <tiny_gltf.h>
