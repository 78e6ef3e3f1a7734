/*
 * A cube of 8 x 8 x 8 LEDs on an Arduino Uno, Nano or any board with an ATmega328P at 16 MHz.
 *
 * The 64 columns of a layer hang on a chain of eight 74HC595, whose data is pin 11, clock pin 13 and
 * latch pin 10: y = 7 and x = 7 are shifted first. Pins 2 to 9 switch the layers z = 0 to 7. A timer
 * lights one layer in each millisecond: 125 refreshes per second.
 *
 * The line is the board's own, 115200 baud. Its interrupt fills a queue and not the core's ring: on
 * a processor of 8 bits the ring's indices are not read in one instruction. The queue has room for
 * all that the credit allows, so that nothing is lost while the device draws.
 *
 * The Arduino IDE wants all sources in one folder: make -C firmware sketch builds it.
 */
extern "C" {
#include "voxel_device.h"
}

/* Bits of port B. */
#define LATCH _BV(2)
#define DATA _BV(3)
#define CLOCK _BV(5)

#define LAYER_MS 1
#define REFRESH_MILLIHERTZ (1000000UL / (8 * LAYER_MS))
#define BAUD 115200UL

/* One bit for each voxel, in scan order: a byte is a row of x. */
static uint8_t pages[2][VXD_VOXELS / 8];
static volatile uint8_t front;      /* the page that is scanned */
static volatile bool swap_wanted;   /* exchange the pages when all layers have been lit */
static volatile bool refreshed;
static uint8_t layer;

static uint8_t queue[256]; /* as many as an index of 8 bits reaches, so that it wraps by itself */
static volatile uint8_t queue_head, queue_tail;
static bool after_zero = true;

static struct vxd_identity identity = {0, REFRESH_MILLIHERTZ, "LED cube", "1.0", ""};

ISR(USART_RX_vect)
{
    const uint8_t byte = UDR0;

    /* A 00 that ends nothing takes no room (section 9.2). */
    if ((byte == 0 && after_zero) || (uint8_t)(queue_head + 1) == queue_tail) {
        return;
    }
    after_zero = byte == 0;
    queue[queue_head] = byte;
    queue_head = queue_head + 1;
}

static void select_layer(uint8_t mask)
{
    PORTD = (uint8_t)((PORTD & 0x03) | (mask << 2));
    PORTB = (uint8_t)((PORTB & ~0x03) | (mask >> 6));
}

ISR(TIMER1_COMPA_vect)
{
    layer = (layer + 1) & 7;
    if (layer == 0) {
        if (swap_wanted) {
            front = 1 - front;
            swap_wanted = false;
        }
        refreshed = true;
    }
    const uint8_t *rows = pages[front] + 8 * layer;
    for (uint8_t y = 8; y-- != 0;) {
        for (uint8_t row = rows[y], x = 8; x-- != 0; row <<= 1) {
            if (row & 0x80) {
                PORTB |= DATA;
            } else {
                PORTB &= (uint8_t)~DATA;
            }
            PORTB |= CLOCK;
            PORTB &= (uint8_t)~CLOCK;
        }
    }
    select_layer(0); /* no layer shows the columns of another */
    PORTB |= LATCH;
    PORTB &= (uint8_t)~LATCH;
    select_layer((uint8_t)(1 << layer));
}

void vxd_clear(void)
{
    memset(pages[1 - front], 0, sizeof pages[0]);
}

void vxd_put(uint32_t index, uint32_t value)
{
    uint8_t *row = &pages[1 - front][index / 8];
    const uint8_t bit = (uint8_t)(1 << (index % 8));

    *row = value != 0 ? *row | bit : *row & (uint8_t)~bit;
}

/* Wait until the last layer has had its time: at most one refresh. */
void vxd_show(void)
{
    swap_wanted = true;
    while (swap_wanted) {
    }
}

void vxd_keep(void)
{
    memcpy(pages[1 - front], pages[front], sizeof pages[0]);
}

uint32_t vxd_get(bool back, uint32_t index)
{
    return pages[back ? 1 - front : front][index / 8] >> (index % 8) & 1;
}

void vxd_send(uint8_t byte)
{
    while (!(UCSR0A & _BV(UDRE0))) {
    }
    UDR0 = byte;
}

void setup(void)
{
    DDRD |= 0xFC;
    DDRB |= 0x03 | LATCH | DATA | CLOCK;
    TCCR1A = 0;
    TCCR1B = _BV(WGM12) | _BV(CS11); /* F_CPU / 8, up to OCR1A */
    OCR1A = F_CPU / 8 / 1000 * LAYER_MS - 1;
    TIMSK1 = _BV(OCIE1A);
    vxd_start(&identity);
    UBRR0 = (F_CPU / 4 / BAUD - 1) / 2;
    UCSR0A |= _BV(U2X0);
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
    while (queue_head == queue_tail) {
    }
    /* The moment of the first byte is as random as a board without a clock can have it. */
    identity.boot = (uint16_t)micros();
}

void loop(void)
{
    while (queue_head != queue_tail) {
        vxd_receive(queue[queue_tail]);
        queue_tail = queue_tail + 1;
    }
    vxd_poll();
    if (refreshed) {
        refreshed = false;
        vxd_tick();
    }
}
