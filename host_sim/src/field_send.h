/** The sending half of the field. */
#ifndef SIM_FIELD_SEND_H
#define SIM_FIELD_SEND_H

#include "field.h"

/** A connector starts: its frames are due soon, and then in phases of their own. */
void sim_field_start_connector(sim_field_t *field, unsigned connector);

void sim_field_start_gateway(sim_field_t *field);

/** Every node that lives sends what is due. */
void sim_field_send(sim_field_t *field);

#endif
