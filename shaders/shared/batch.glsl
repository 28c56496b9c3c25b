// How many items a thread of a dispatch works on. See main.glsl.

/// Items that a thread takes one after the other when so many wait.
uint items_a_thread(uint items) {
    return clamp(items / ITEMS_FOR_EACH, 1u, step_now.most_a_thread);
}

/// Workgroups for so many items. Where threads take several, a quarter is to spare: who comes to the end of its share of workgroups sooner takes more.
uint workgroups_for(uint items, uint each) {
    uint in_workgroup = WORKGROUP * each;
    uint needed = (items + in_workgroup - 1u) / in_workgroup;
    return needed + (each > 1u ? (needed + 3u) / 4u : 0u);
}
