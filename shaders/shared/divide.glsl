// Whole division by way of floats: software Vulkan has no vector instruction for integers and divides lane by lane, which
// took a fifth of a primary ray's time.

/// Quotient and remainder of a value below 2²⁴.
uvec2 divide(uint value, uint divisor) {
    // Rounded to nearest or a little worse, the quotient is off by at most one. Signed numbers are converted by one instruction.
    uint quotient = uint(int(float(int(value)) / float(int(divisor))));
    uint rest = value - quotient * divisor;
    if (int(rest) < 0) {
        quotient -= 1u;
        rest += divisor;
    } else if (rest >= divisor) {
        quotient += 1u;
        rest -= divisor;
    }
    return uvec2(quotient, rest);
}
