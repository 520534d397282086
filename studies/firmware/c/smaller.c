
static real smaller(real a, real b)
{
    return b < a ? b : a;
}
