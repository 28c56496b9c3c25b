// First include of every kernel: language, contract, workgroup.
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "layout.glsl"
#include "features.glsl"
#include "bindings.glsl"
layout(local_size_x = WORKGROUP) in;
