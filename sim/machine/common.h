// What benches of Verilated components have in common.

#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

struct AssertionFailed {};

// xorshift64*: Marsaglia's generator, a few cycles a number.
struct Random {
    uint64_t state;
    uint32_t operator()() {
        state ^= state >> 12, state ^= state << 25, state ^= state >> 27;
        return uint32_t(state * 0x2545F4914F6CDD1D >> 32);
    }
    uint32_t below(uint32_t bound) { return uint32_t(uint64_t((*this)()) * bound >> 32); }
    bool chance(double probability) { return (*this)() < probability * 4294967296.0; }
};

// A port of any width as 32-bit words.
template <class T>
uint32_t word(const T& port, int number) {
    if constexpr (std::is_integral_v<T>)
        return number < int(sizeof(T) + 3) / 4 ? uint32_t(uint64_t(port) >> 32 * number) : 0;
    else
        return port.at(number);
}

template <class T>
uint32_t field(const T& port, int low, int width) {
    int number = low / 32, shift = low % 32;
    uint64_t pair = word(port, number);
    if (shift + width > 32) pair |= uint64_t(word(port, number + 1)) << 32;
    return uint32_t(pair >> shift) & uint32_t((uint64_t(1) << width) - 1);
}

template <class T>
void assign(T& port, const uint32_t* words) {
    if constexpr (std::is_integral_v<T>) {
        uint64_t value = words[0];
        if (sizeof(T) > 4) value |= uint64_t(words[1]) << 32;
        port = T(value);
    } else {
        for (size_t number = 0; number < sizeof(port) / 4; ++number) port.at(number) = words[number];
    }
}
