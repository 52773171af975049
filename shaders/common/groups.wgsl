// Number of a workgroup among those of its pass. Software drivers give each core a range of a dispatch: in large steps, every range has workgroups from
// all over the picture, and takes about as long as the others. On a GPU the step is 1, since neighbours share its caches.
#include "common/params.wgsl"

fn group_number(group: u32, groups: u32) -> u32 {
    return params.first_group + group * params.group_step % groups;
}
