/* A view of sixteen numbers, as tests and benchmarks write them. */
#ifndef GIVEN_VIEW_H
#define GIVEN_VIEW_H

static occluder_view look(const double *numbers)
{
    occluder_view view;
    memcpy(view.eye, numbers, sizeof view.eye);
    memcpy(view.right, numbers + 3, sizeof view.right);
    memcpy(view.up, numbers + 6, sizeof view.up);
    memcpy(view.ahead, numbers + 9, sizeof view.ahead);
    view.focal = numbers[12];
    view.near_depth = numbers[13];
    view.rows = (uint32_t)numbers[14];
    view.columns = (uint32_t)numbers[15];
    return view;
}

#endif
