// The board round a Verilated DynRTC: a clock, memories with latency, and a place for the pixels.
//
// Driven a frame at a time through the C functions at the end; see bench.py for what they mean.

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <deque>
#include <memory>
#include <random>
#include <vector>

#include "Vdynrtc.h"
#include "bench.h"
#include "verilated.h"
#if BENCH_TRACE == 1
#include "verilated_vcd_c.h"
using Trace = VerilatedVcdC;
#elif BENCH_TRACE == 2
#include "verilated_fst_c.h"
using Trace = VerilatedFstC;
#endif

namespace {

// A memory that answers in order, a word a cycle, the first of a line `latency` cycles after its request; with
// jitter both the latency and the pace are random.
struct Memory {
    const uint32_t* words = nullptr;
    uint64_t num_words = 0;
    uint32_t line_words = 1;
    uint32_t latency = 1, jitter = 0;
    std::deque<std::pair<uint64_t, uint64_t>> pending;  // cycle of the first word, address
    uint32_t position = 0;
    uint64_t words_read = 0;

    bool accepts(std::mt19937& random) const { return pending.size() < 16 && (!jitter || random() % 4); }

    bool request(uint64_t line, uint64_t now, std::mt19937& random) {
        uint64_t delay = latency + (jitter ? random() % (jitter + 1) : 0);
        pending.emplace_back(now + delay, line * line_words);
        return (line + 1) * line_words <= num_words;
    }

    bool answer(uint64_t now, uint32_t& data, std::mt19937& random) {
        if (pending.empty() || pending.front().first > now || (jitter && random() % 8 == 0)) return false;
        data = words[pending.front().second + position];
        ++words_read;
        if (++position == line_words) {
            position = 0;
            pending.pop_front();
        }
        return true;
    }
};

struct Bench {
    VerilatedContext context;
    std::unique_ptr<Vdynrtc> chip;
    Memory memories[5];
    std::mt19937 random{1};
    bool jitter = false;
    uint64_t cycle = 0;
    Watch watch;
    volatile bool interrupted = false;
#if BENCH_TRACE
    std::unique_ptr<Trace> trace;
    uint64_t trace_from = 0, trace_to = 0;
#endif

    Bench() {
        const char* arguments[] = {"bench"};
        context.commandArgs(1, arguments);
#if BENCH_TRACE
        context.traceEverOn(true);
#endif
        chip = std::make_unique<Vdynrtc>(&context);
        chip->rst = 1;
        chip->pixel_ready = 1;
        for (int number = 0; number < 2; ++number) tick();
        chip->rst = 0;
    }

    ~Bench() {
#if BENCH_TRACE
        if (trace) trace->close();
#endif
        chip->final();
    }

    // The falling edge comes first: it is when the chip's logic sees what was set since the last rising edge.
    void tick() {
        chip->clk = 0;
        chip->eval();
        dump(10 * cycle);
        chip->clk = 1;
        chip->eval();
        dump(10 * cycle + 5);
        ++cycle;
    }

    void dump(uint64_t time) {
#if BENCH_TRACE
        if (trace && cycle >= trace_from && cycle < trace_to) trace->dump(time);
#endif
    }

    // What the chip drives now is taken at the next edge, together with what is set here.
    template <class Address>
    bool serve(Memory& memory, const Address& address, bool valid, CData& ready, CData& data_valid, IData& data) {
        bool known = true;
        ready = memory.accepts(random);
        if (valid && ready) known = memory.request(address, cycle, random);
        data_valid = known && memory.answer(cycle, data, random);
        return known;
    }

    Status run(uint64_t max_cycles, uint64_t hang_cycles, uint32_t coord_width, uint32_t thread_width, uint32_t width,
               uint32_t height, uint32_t pixel_words, uint32_t* pixels, uint64_t* written, uint64_t* begun,
               uint32_t num_packets) {
        uint64_t end = cycle + max_cycles, first = cycle;
        uint32_t packets = 0;
        watch.quiet_since = cycle;
        chip->start = 1;
        tick();
        chip->start = 0;
        while (!(chip->ready)) {
            if (cycle >= end) return OUT_OF_CYCLES;
            if (interrupted) return INTERRUPTED;
            watch.threads(chip->probe, cycle, cycle - first, thread_width, begun, num_packets, packets);
            if (chip->pixel_valid && chip->pixel_ready &&
                !watch.pixel(chip->pixel_payload, cycle, cycle - first, coord_width, width, height, pixel_words, pixels,
                             written))
                return BAD_PIXEL;
            if (cycle - watch.quiet_since > hang_cycles) return HUNG;
            bool known = true;
            known &= serve(memories[0], chip->nodes_request_payload, chip->nodes_request_valid,
                           chip->nodes_request_ready, chip->nodes_data_valid, chip->nodes_data_payload);
            known &= serve(memories[1], chip->lists_request_payload, chip->lists_request_valid,
                           chip->lists_request_ready, chip->lists_data_valid, chip->lists_data_payload);
            known &= serve(memories[2], chip->matrices_request_payload, chip->matrices_request_valid,
                           chip->matrices_request_ready, chip->matrices_data_valid, chip->matrices_data_payload);
            known &= serve(memories[3], chip->shading_request_payload, chip->shading_request_valid,
                           chip->shading_request_ready, chip->shading_data_valid, chip->shading_data_payload);
#if BENCH_TEXTURES
            known &= serve(memories[4], chip->textures_request_payload, chip->textures_request_valid,
                           chip->textures_request_ready, chip->textures_data_valid, chip->textures_data_payload);
#endif
            if (!known) return BAD_ADDRESS;
            tick();
            if (jitter) chip->pixel_ready = random() % 4 != 0;
        }
        return DONE;
    }
};

}  // namespace

// Verilator's own would end the process.
void vl_stop(const char*, int, const char*) { throw AssertionFailed{}; }

extern "C" {

Bench* bench_new() { return new Bench; }

void bench_delete(Bench* bench) { delete bench; }

void bench_memory(Bench* bench, int32_t number, const uint32_t* words, uint64_t num_words, uint32_t line_words) {
    Memory& memory = bench->memories[number];
    memory.words = words;
    memory.num_words = num_words;
    memory.line_words = line_words;
}

void bench_latency(Bench* bench, int32_t number, uint32_t latency, uint32_t jitter, uint32_t seed) {
    bench->memories[number].latency = latency;
    bench->memories[number].jitter = jitter;
    bench->jitter = jitter;
    bench->random.seed(seed);
}

void bench_picture(Bench* bench, const uint32_t* camera, uint32_t root, uint32_t width, uint32_t height,
                   uint32_t background) {
    assign(bench->chip->camera, camera);
    bench->chip->root = root;
    bench->chip->width = width;
    bench->chip->height = height;
    bench->chip->background = background;
}

int32_t bench_run(Bench* bench, uint64_t max_cycles, uint64_t hang_cycles, uint32_t coord_width,
                  uint32_t thread_width, uint32_t width, uint32_t height, uint32_t pixel_words, uint32_t* pixels,
                  uint64_t* written, uint64_t* begun, uint32_t num_packets) {
    try {
        return bench->run(max_cycles, hang_cycles, coord_width, thread_width, width, height, pixel_words, pixels,
                          written, begun, num_packets);
    } catch (const AssertionFailed&) {
        return ASSERTION;
    }
}

void bench_interrupt(Bench* bench) { bench->interrupted = true; }

uint64_t bench_cycle(Bench* bench) { return bench->cycle; }

uint64_t bench_words_read(Bench* bench, int32_t number) { return bench->memories[number].words_read; }

void bench_counters(Bench* bench, uint32_t* counters, uint32_t count) {
    for (uint32_t number = 0; number < count; ++number) counters[number] = word(bench->chip->counters, number);
}

void bench_threads(Bench* bench, int32_t* unit, uint64_t* cycle) {
    std::memcpy(unit, bench->watch.last_unit, sizeof bench->watch.last_unit);
    std::memcpy(cycle, bench->watch.last_entry, sizeof bench->watch.last_entry);
}

int32_t bench_trace(Bench* bench, const char* path, uint64_t from, uint64_t to) {
#if BENCH_TRACE
    bench->trace = std::make_unique<Trace>();
    bench->chip->trace(bench->trace.get(), 99);
    bench->trace->open(path);
    bench->trace_from = bench->cycle + from;
    bench->trace_to = bench->cycle + to;
    return bench->trace->isOpen();
#else
    return 0;
#endif
}
}
