"""The fast form of `reojax.mechanics.momentum` and of the integration of `R' = R hat(omega)`.

XLA's CPU code is fast when every scalar component is an array of its own: `vmap` then makes each one
a contiguous array, a whole evaluation of omega becomes one vectorised loop, and no small matrix products
are left. So vectors here are triples of scalars, and an evaluation is written for one scalar shape, all
quadrature nodes of the path. Files, in the order of use:

    scalar      arithmetic that leaves out zeros known beforehand, vectors as triples
    components  a robot's arrays as scalars, with the zeros and ones that are known
    sincos      a sine and cosine that vectorise
    store       values computed once, side by side, for many readers
    nodes       joint angles and rates at the quadrature nodes of a path, and sums over nodes
    omega       angular velocity of the base at all nodes (thesis eq. 2.14)
    steps       omega at the nodes of a step to the rotation over the step
    product     the ordered product of the steps' rotations
    endpoint    all of it in a row, and its derivative, which needs
    momentum    the angular momentum with everything moving, for forward mode,
    virtual     its derivative in closed form, for reverse mode, and
    blocks      batches of designs in blocks that stay in the cache
"""
