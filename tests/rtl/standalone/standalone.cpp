// A StandaloneTop with its three clocks, and what it sends to a screen.

#include <cstdint>
#include <memory>

#include "Vcomponent.h"
#include "common.h"
#include "verilated.h"

namespace {

struct Bench {
    VerilatedContext context;
    std::unique_ptr<Vcomponent> top = std::make_unique<Vcomponent>(&context);
    // In picoseconds
    uint64_t sync_period, shift_period, next_sync = 0, next_shift = 0, shifts = 0;

    Bench(uint64_t sync_period, uint64_t shift_period) : sync_period(sync_period), shift_period(shift_period) {
        top->rst = top->pixel_rst = top->shift_rst = 0;
    }

    void shift(uint8_t* pairs) {
        while (next_sync <= next_shift) {
            top->clk = 0;
            top->eval();
            top->clk = 1;
            top->eval();
            next_sync += sync_period;
        }
        if (shifts % 5 == 0) top->pixel_clk = 1;
        if (shifts % 5 == 2) top->pixel_clk = 0;
        top->shift_clk = 0;
        top->eval();
        if (pairs) *pairs = top->pairs;
        top->shift_clk = 1;
        top->eval();
        ++shifts;
        next_shift += shift_period;
    }
};

}  // namespace

void vl_stop(const char*, int, const char*) { throw AssertionFailed{}; }

extern "C" {

Bench* bench_new(uint64_t sync_period, uint64_t shift_period) { return new Bench(sync_period, shift_period); }

void bench_delete(Bench* bench) { delete bench; }

// Goes on until so many pictures are drawn, of which the lamps have the lowest two bits; 0 if that takes too long.
int32_t bench_draw(Bench* bench, uint32_t pictures, uint64_t most) {
    try {
        for (; most; --most) {
            bench->shift(nullptr);
            if (bench->top->lamps >> 1 == (pictures & 3)) return 1;
        }
    } catch (const AssertionFailed&) {
    }
    return 0;
}

int32_t bench_watch(Bench* bench, uint8_t* pairs, uint64_t count) {
    try {
        while (count--) bench->shift(pairs++);
    } catch (const AssertionFailed&) {
        return 0;
    }
    return 1;
}
}
