//// bits
static uint64_t @_bits(double x) { uint64_t bits; memcpy(&bits, &x, sizeof bits); return bits; }

//// of_bits
static double @_of_bits(uint64_t bits) { double x; memcpy(&x, &bits, sizeof x); return x; }

//// quarter_turns
static double @_quarter_turns(double own, double other, uint64_t quarters, uint64_t sign) {
    const uint64_t odd = UINT64_C(0) - (quarters & 1), a = @_bits(own), b = @_bits(other);
    return @_of_bits((a ^ ((a ^ b) & odd)) ^ ((sign & 2) << 62));
}

//// sin_cos
static void @_sin_cos(double x, double *sine, double *cosine) {
    const double rounding = 6755399441055744.0, rounded = x * 0.6366197723675814 + rounding;
    const double k = rounded - rounding;
    const double r = ((x - k * 1.5707963267341256) - k * 6.077100506303966e-11) - k * 2.0222662487959506e-21;
    const double z = r * r;
    const double p = -1.6666666666666632e-1 + z * (8.33333333332249e-3 + z * (-1.984126982985795e-4
        + z * (2.7557313707070068e-6 + z * (-2.5050760253406863e-8 + z * 1.58969099521155e-10))));
    const double c = 4.166666666666666e-2 + z * (-1.388888888887411e-3 + z * (2.480158728947673e-5
        + z * (-2.7557314351390663e-7 + z * (2.087572321298175e-9 + z * -1.1359647557788195e-11))));
    const double s = r + r * z * p, o = (1.0 - 0.5 * z) + z * z * c;
    const uint64_t quarters = @_bits(rounded);
    *sine = @_quarter_turns(s, o, quarters, quarters);
    *cosine = @_quarter_turns(o, s, quarters, quarters + 1);
}

//// tanh
static double @_tanh(double x) {
    const double rounding = 6755399441055744.0, size = x < 0.0 ? -x : x;
    const double twice = 2.0 * (size > 20.0 ? 20.0 : size), rounded = twice * 1.4426950408889634 + rounding;
    const double k = rounded - rounding;
    const double r = (twice - k * 0.6931471803691238) - k * 1.9082149292705877e-10;
    const double e = r + r * r * (1.0 / 2.0 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0
        + r * (1.0 / 5040.0 + r * (1.0 / 40320.0 + r * (1.0 / 362880.0 + r * (1.0 / 3628800.0
        + r * (1.0 / 39916800.0 + r * (1.0 / 479001600.0 + r / 6227020800.0)))))))))));
    const double power = @_of_bits((@_bits(rounded) + 1023) << 52), grown = power * e + (power - 1.0);
    return x < 0.0 ? -(grown / (grown + 2.0)) : grown / (grown + 2.0);
}

//// sign
static double @_sign(double x) { return (double)((x > 0.0) - (x < 0.0)); }

//// dead_band_sign
static double @_dead_band_sign(double x, double threshold) {
    return (x < 0.0 ? -x : x) < threshold ? 0.0 : @_sign(x);
}
