#include "queue.h"

#include <math.h>
#include <stdlib.h>

#include "memory.h"

typedef struct {
    double arrival_s;
    size_t session;
} arrival_t;

static int compare_arrival(const void *a, const void *b) {
    const arrival_t *left = a;
    const arrival_t *right = b;
    if (left->arrival_s != right->arrival_s) {
        return left->arrival_s < right->arrival_s ? -1 : 1;
    }
    return (left->session > right->session) - (left->session < right->session);
}

static size_t *order_by_arrival(const sim_sessions_t *sessions) {
    arrival_t *arrivals = sim_allocate(sessions->count, sizeof *arrivals);
    for (size_t i = 0; i < sessions->count; i++) {
        arrivals[i] = (arrival_t){.arrival_s = sessions->session[i].arrival_s, .session = i};
    }
    qsort(arrivals, sessions->count, sizeof *arrivals, compare_arrival);
    size_t *order = sim_allocate(sessions->count, sizeof *order);
    for (size_t i = 0; i < sessions->count; i++) {
        order[i] = arrivals[i].session;
    }
    free(arrivals);
    return order;
}

void sim_queue_init(sim_queue_t *queue, const sim_sessions_t *sessions, sim_evse_t *evse, unsigned connectors,
                    sim_outcome_t *outcome) {
    *queue = (sim_queue_t){.sessions = sessions,
                           .evse = evse,
                           .connectors = connectors,
                           .outcome = outcome,
                           .order = order_by_arrival(sessions)};
    for (unsigned i = 0; i < connectors; i++) {
        queue->free += evse[i].closed ? 0 : 1;
    }
}

void sim_queue_free(sim_queue_t *queue) {
    free(queue->order);
    free(queue->waiting);
    *queue = (sim_queue_t){0};
}

/** Vehicles whose time has come leave their connectors; what they got is written down. */
static void unplug_departed(sim_queue_t *queue, double now_s) {
    for (unsigned i = 0; i < queue->connectors; i++) {
        sim_evse_t *evse = &queue->evse[i];
        if (evse->vehicle != NULL && evse->vehicle->departure_s <= now_s) {
            queue->outcome[queue->at[i]].energy_kwh = evse->energy_kwh;
            sim_evse_unplug(evse);
            queue->free++;
        }
    }
}

/** Who has come by `now_s` joins the end of the queue. */
static void admit(sim_queue_t *queue, int64_t now_s) {
    while (queue->next < queue->sessions->count) {
        const size_t session = queue->order[queue->next];
        if (queue->sessions->session[session].arrival_s > (double)now_s) {
            return;
        }
        queue->waiting =
            sim_grow(queue->waiting, &queue->waiting_room, queue->waiting_count + 1, sizeof *queue->waiting);
        queue->waiting[queue->waiting_count++] = (sim_waiting_t){.session = session, .since_s = now_s};
        queue->next++;
    }
}

static bool is_free(const sim_evse_t *evse) {
    return evse->vehicle == NULL && !evse->closed;
}

/** A free connector for a session, or -1. */
static int find_connector(const sim_queue_t *queue, const sim_session_t *session) {
    if (queue->free == 0) {
        return -1;
    }
    if (session->connector != 0) {
        const unsigned own = session->connector - 1;
        return is_free(&queue->evse[own]) ? (int)own : -1;
    }
    unsigned lowest = 0;
    while (!is_free(&queue->evse[lowest])) {
        lowest++;
    }
    return (int)lowest;
}

/** Deal with the vehicle at the head of the queue. @return false: it goes on waiting. */
static bool serve(sim_queue_t *queue, const sim_waiting_t *waiting, int64_t now_s) {
    const sim_session_t *session = &queue->sessions->session[waiting->session];
    sim_outcome_t *outcome = &queue->outcome[waiting->session];
    if (session->departure_s <= (double)now_s) {
        outcome->queued_s = session->departure_s - session->arrival_s;
        return true;
    }
    const int connector = find_connector(queue, session);
    if (connector < 0) {
        return false;
    }
    sim_evse_plug(&queue->evse[connector], session);
    queue->at[connector] = waiting->session;
    queue->free--;
    outcome->connector = (unsigned)connector + 1;
    outcome->queued_s = waiting->since_s == now_s ? 0.0 : (double)now_s - session->arrival_s;
    return true;
}

void sim_queue_leave(sim_queue_t *queue, int64_t now_s) {
    unplug_departed(queue, (double)now_s);
}

void sim_queue_advance(sim_queue_t *queue, int64_t now_s) {
    unplug_departed(queue, (double)now_s);
    admit(queue, now_s);
    size_t kept = 0;
    for (size_t i = 0; i < queue->waiting_count; i++) {
        const sim_waiting_t waiting = queue->waiting[i];
        if (!serve(queue, &waiting, now_s)) {
            queue->waiting[kept++] = waiting;
        }
    }
    queue->waiting_count = kept;
}

bool sim_queue_is_over(const sim_queue_t *queue) {
    bool over = queue->next == queue->sessions->count && queue->waiting_count == 0;
    for (unsigned i = 0; i < queue->connectors; i++) {
        over = over && queue->evse[i].vehicle == NULL;
    }
    return over;
}

void sim_queue_finish(sim_queue_t *queue) {
    unplug_departed(queue, INFINITY);
    admit(queue, INT64_MAX);
    for (size_t i = 0; i < queue->waiting_count; i++) {
        const sim_session_t *session = &queue->sessions->session[queue->waiting[i].session];
        queue->outcome[queue->waiting[i].session].queued_s = session->departure_s - session->arrival_s;
    }
    queue->waiting_count = 0;
}
